/* What is carried from the input of a context to its result. */
#pragma once

#include "products/attributes/transfer.h"
#include "run/driver.h"

typedef struct qw_carried {
    qw_source source;
    qw_origins origins;
    qw_provenance provenance;
} qw_carried;
