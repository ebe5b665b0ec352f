/* A suite is the tests of one file, and a function that runs them: suites.def lists them, suites.c is their main. */
#ifndef QW_TESTS_SUITE_H
#define QW_TESTS_SUITE_H

#include <stdbool.h>
#include <stdlib.h>

/* Whether QW_SHORT is set, as by .ci/run for the programs with sanitizers, in which a suite takes several times as
   long: whole runs then stand for others like them, and of many allocations that fail not each is tried. `make test`
   and `make test-long` leave nothing out. */
static inline bool suite_is_short(void) { return getenv("QW_SHORT") != NULL; }

/* The number of allocations that succeed next. */
static inline long suite_next_failure(long n) { return suite_is_short() ? n + 1 + n / 8 : n + 1; }

/* Head of the function that runs a suite. It returns how many tests failed. */
#define QW_TEST_SUITE(name)                     \
    static int run_suite_##name(void);          \
    int qw_suite_##name(int argc, char **argv); \
    int qw_suite_##name(int argc, char **argv)  \
    {                                           \
        (void)argc, (void)argv;                 \
        return run_suite_##name();              \
    }                                           \
    static int run_suite_##name(void)

/* The same for a suite that reads what follows its name on the command line, argv[1] on. */
#define QW_TEST_SUITE_WITH_ARGUMENTS(name)      \
    int qw_suite_##name(int argc, char **argv); \
    int qw_suite_##name(int argc, char **argv)

#endif
