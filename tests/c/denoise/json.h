/* Reads JSON: as much of it as manifest.json needs. */
#ifndef JSON_H
#define JSON_H

#include <stddef.h>
#include <stdint.h>

typedef enum { JSON_NULL, JSON_BOOLEAN, JSON_NUMBER, JSON_STRING, JSON_ARRAY, JSON_OBJECT } JsonKind;

/* A value, in a list with its siblings if it is part of an array or object. */
typedef struct Json {
    JsonKind kind;
    const char *name;   /* key of a member of an object */
    const char *string; /* of JSON_STRING */
    double number;      /* of JSON_NUMBER; 0 or 1 of JSON_BOOLEAN */
    uint32_t count;     /* parts of an array or object */
    struct Json *first, *next;
} Json;

/* All bytes of FOLDER/NAME, with a zero behind them. Ends the program if there is no such file. */
char *read_file(const char *folder, const char *name, size_t *size);

/* The value that FOLDER/NAME holds. Lives as long as the program. */
const Json *json_read(const char *folder, const char *name);

/* Parts of an object. The first gives NULL where there is none, the others end the program. */
const Json *json_find(const Json *object, const char *name);
const Json *json_get(const Json *object, const char *name);
const char *json_string(const Json *object, const char *name);
double json_number(const Json *object, const char *name);
uint32_t json_uint(const Json *object, const char *name);
int json_is(const Json *object, const char *name, const char *string);
int json_true(const Json *object, const char *name);
void json_floats(const Json *object, const char *name, float *out, uint32_t count);

/* Ends the program with a message. */
#if defined(__GNUC__)
__attribute__((noreturn, format(printf, 1, 2)))
#endif
void die(const char *format, ...);

#endif
