/* A suite is tests of one file, and a function that runs them: suites.def lists them, suites.c is their main. A file
 * has a second suite where ThreadSanitizer or another label is wanted for a part of its tests only. */
#ifndef QW_TESTS_SUITE_H
#define QW_TESTS_SUITE_H

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
