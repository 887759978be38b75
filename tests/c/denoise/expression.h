/* Sizes in manifest.json: expressions of `width` and `height`, such as "(width + 7) / 8". Division rounds down. */
#ifndef EXPRESSION_H
#define EXPRESSION_H

#include <stdint.h>

/* The value of an expression. Ends the program if it is none. */
uint64_t evaluate(const char *expression, uint64_t width, uint64_t height);

#endif
