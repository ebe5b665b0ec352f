/* Decimal numbers, free of the locale: reading is correctly rounded, printing reads back to the same double. */
#pragma once

#include <stdbool.h>
#include <stddef.h>

enum { QW_NUMBER_SIZE = 32 }; /* room for any printed double */

/* Reads a number at *at and moves *at past it. Eight zeros follow the text. False, and nothing moved, where there is
   none. "nan", "inf" and the like are numbers too, and 1e999 is infinite: whether that is allowed is for the caller to
   say. */
bool qw_number_read(const char **at, double *value);

/* The shortest decimal that reads back to value, which is finite. (A power of two may get a digit more than it needs,
   and a subnormal number 15.) Not terminated; returns its length. */
size_t qw_number_print(char out[QW_NUMBER_SIZE], double value);
