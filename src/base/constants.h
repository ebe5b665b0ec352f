/* The constants of constants.def, as QW_name. */
#pragma once

#define QW_REAL_CONSTANT(name, value, unit, reason)  static const double QW_##name = (value);
#define QW_COUNT_CONSTANT(name, value, unit, reason) enum { QW_##name = (value) };
#include "base/constants.def"
#undef QW_REAL_CONSTANT
#undef QW_COUNT_CONSTANT
