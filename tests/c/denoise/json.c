#include "json.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void die(const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    fputs("error: ", stderr);
    vfprintf(stderr, format, arguments);
    fputc('\n', stderr);
    va_end(arguments);
    exit(1);
}

char *read_file(const char *folder, const char *name, size_t *size) {
    char path[4096];
    if (snprintf(path, sizeof path, "%s/%s", folder, name) >= (int)sizeof path) {
        die("the path %s/%s is too long", folder, name);
    }
    FILE *file = fopen(path, "rb");
    if (file == NULL || fseek(file, 0, SEEK_END) != 0) {
        die("cannot read %s", path);
    }
    const long length = ftell(file);
    rewind(file);
    char *bytes = malloc((size_t)length + 1);
    if (bytes == NULL || fread(bytes, 1, (size_t)length, file) != (size_t)length) {
        die("cannot read %s", path);
    }
    fclose(file);
    bytes[length] = 0;
    if (size != NULL) {
        *size = (size_t)length;
    }
    return bytes;
}

/* Where the parser is, and what is parsed, for messages. */
typedef struct Parser {
    const char *file, *start;
    char *at;
} Parser;

static void fail(const Parser *parser, const char *expected) {
    int line = 1;
    for (const char *c = parser->start; c < parser->at; c++) {
        line += *c == '\n';
    }
    die("%s, line %d: expected %s", parser->file, line, expected);
}

static char next(Parser *parser) {
    parser->at += strspn(parser->at, " \t\r\n");
    return *parser->at;
}

static int accept(Parser *parser, char c) {
    if (next(parser) != c) {
        return 0;
    }
    parser->at++;
    return 1;
}

/* A string, unescaped where it stands. */
static const char *parse_string(Parser *parser) {
    if (!accept(parser, '"')) {
        fail(parser, "a string");
    }
    char *const start = parser->at, *out = start;
    while (*parser->at != '"') {
        char c = *parser->at++;
        if (c == '\\') {
            c = *parser->at++;
            const char *const escape = strchr("n\nt\tr\r\"\"\\\\//", c);
            if (c == 0 || escape == NULL) {
                fail(parser, "another escape");
            }
            c = escape[1];
        }
        if (c == 0) {
            fail(parser, "the end of a string");
        }
        *out++ = c;
    }
    parser->at++;
    *out = 0;
    return start;
}

static int accept_word(Parser *parser, const char *word) {
    const size_t length = strlen(word);
    if (strncmp(parser->at, word, length) != 0) {
        return 0;
    }
    parser->at += length;
    return 1;
}

static Json *parse_value(Parser *parser);

static void parse_parts(Parser *parser, Json *value, char end) {
    Json **last = &value->first;
    if (accept(parser, end)) {
        return;
    }
    do {
        const char *const name = value->kind == JSON_OBJECT ? parse_string(parser) : NULL;
        if (name != NULL && !accept(parser, ':')) {
            fail(parser, "`:`");
        }
        *last = parse_value(parser);
        (*last)->name = name;
        last = &(*last)->next;
        value->count++;
    } while (accept(parser, ','));
    if (!accept(parser, end)) {
        fail(parser, end == '}' ? "`,` or `}`" : "`,` or `]`");
    }
}

static Json *parse_value(Parser *parser) {
    Json *value = calloc(1, sizeof *value);
    if (value == NULL) {
        die("out of memory");
    }
    const char c = next(parser);
    if (accept(parser, '{')) {
        value->kind = JSON_OBJECT;
        parse_parts(parser, value, '}');
    } else if (accept(parser, '[')) {
        value->kind = JSON_ARRAY;
        parse_parts(parser, value, ']');
    } else if (c == '"') {
        value->kind = JSON_STRING;
        value->string = parse_string(parser);
    } else if (accept_word(parser, "null")) {
        value->kind = JSON_NULL;
    } else if (accept_word(parser, "true") || accept_word(parser, "false")) {
        value->kind = JSON_BOOLEAN;
        value->number = c == 't';
    } else {
        char *end;
        value->kind = JSON_NUMBER;
        value->number = strtod(parser->at, &end);
        if (end == parser->at) {
            fail(parser, "a value");
        }
        parser->at = end;
    }
    return value;
}

const Json *json_read(const char *folder, const char *name) {
    char *const text = read_file(folder, name, NULL);
    Parser parser = {name, text, text};
    const Json *value = parse_value(&parser);
    if (next(&parser) != 0) {
        fail(&parser, "the end of the file");
    }
    return value;
}

const Json *json_find(const Json *object, const char *name) {
    const Json *part = object->first;
    while (part != NULL && (part->name == NULL || strcmp(part->name, name) != 0)) {
        part = part->next;
    }
    return part;
}

const Json *json_get(const Json *object, const char *name) {
    const Json *part = json_find(object, name);
    if (part == NULL) {
        die("`%s` is missing in a JSON object", name);
    }
    return part;
}

const char *json_string(const Json *object, const char *name) {
    const Json *value = json_get(object, name);
    if (value->kind != JSON_STRING) {
        die("`%s` is not a string", name);
    }
    return value->string;
}

double json_number(const Json *object, const char *name) {
    const Json *value = json_get(object, name);
    if (value->kind != JSON_NUMBER) {
        die("`%s` is not a number", name);
    }
    return value->number;
}

uint32_t json_uint(const Json *object, const char *name) {
    const double number = json_number(object, name);
    if (number < 0 || number > UINT32_MAX) {
        die("`%s` is %g, expected 0 to 4294967295", name, number);
    }
    return (uint32_t)number;
}

int json_is(const Json *object, const char *name, const char *string) {
    return strcmp(json_string(object, name), string) == 0;
}

int json_true(const Json *object, const char *name) {
    return json_get(object, name)->number != 0;
}

void json_floats(const Json *object, const char *name, float *out, uint32_t count) {
    const Json *array = json_get(object, name), *value = array->first;
    if (array->count != count) {
        die("`%s` has %u entries, expected %u", name, array->count, count);
    }
    for (uint32_t i = 0; i < count; i++, value = value->next) {
        out[i] = (float)value->number;
    }
}
