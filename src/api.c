/* The public functions over the tables; the rest of quadwright.h follows below. */
#include "quadwright/quadwright.h"

#define QW_STRING_(x) #x
#define QW_STRING(x) QW_STRING_(x)

const char *qw_version(void)
{
    return QW_STRING(QW_VERSION_MAJOR) "." QW_STRING(QW_VERSION_MINOR) "." QW_STRING(QW_VERSION_PATCH);
}
