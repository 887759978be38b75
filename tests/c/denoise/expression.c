#include "expression.h"

#include <ctype.h>
#include <stdlib.h>
#include <string.h>

#include "json.h"

typedef struct Expression {
    const char *whole, *at;
    uint64_t width, height;
} Expression;

static int accept(Expression *expression, const char *token) {
    expression->at += strspn(expression->at, " ");
    const size_t length = strlen(token);
    const int found = strncmp(expression->at, token, length) == 0;
    expression->at += found ? length : 0;
    return found;
}

static void fail(const Expression *expression) {
    die("manifest.json: cannot evaluate \"%s\" from \"%s\" on", expression->whole, expression->at);
}

static uint64_t sum(Expression *expression);

static uint64_t operand(Expression *expression) {
    if (accept(expression, "width")) {
        return expression->width;
    }
    if (accept(expression, "height")) {
        return expression->height;
    }
    if (accept(expression, "(")) {
        const uint64_t value = sum(expression);
        if (!accept(expression, ")")) {
            fail(expression);
        }
        return value;
    }
    if (!isdigit((unsigned char)*expression->at)) {
        fail(expression);
    }
    char *end;
    const uint64_t value = strtoull(expression->at, &end, 10);
    expression->at = end;
    return value;
}

static uint64_t product(Expression *expression) {
    uint64_t value = operand(expression);
    for (;;) {
        if (accept(expression, "*")) {
            value *= operand(expression);
        } else if (accept(expression, "/")) {
            const uint64_t divisor = operand(expression);
            if (divisor == 0) {
                fail(expression);
            }
            value /= divisor;
        } else {
            return value;
        }
    }
}

static uint64_t sum(Expression *expression) {
    uint64_t value = product(expression);
    while (accept(expression, "+")) {
        value += product(expression);
    }
    return value;
}

uint64_t evaluate(const char *text, uint64_t width, uint64_t height) {
    Expression expression = {text, text, width, height};
    const uint64_t value = sum(&expression);
    expression.at += strspn(expression.at, " ");
    if (*expression.at != 0) {
        fail(&expression);
    }
    return value;
}
