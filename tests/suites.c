/* The one program of unit tests.
 *
 *     quadwright-tests                   every suite
 *     quadwright-tests --list            their names
 *     quadwright-tests SUITE [PATTERN]   one suite, or those of its tests whose names match PATTERN (* and ?)
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#define SUITE(name, labels, seconds) int qw_suite_##name(int argc, char **argv);
#include "suites.def"
#undef SUITE

static const struct {
    const char *name;
    int (*run)(int argc, char **argv);
} suites[] = {
#define SUITE(name, labels, seconds) {#name, qw_suite_##name},
#include "suites.def"
#undef SUITE
};
enum { SUITES = sizeof suites / sizeof *suites };

static int run_all(void)
{
    char *none[] = {NULL, NULL};
    int failed = 0;
    for (int i = 0; i < SUITES; i++) failed += suites[i].run(1, none) != 0;
    printf("%d passed, %d failed\n", SUITES - failed, failed);
    return failed != 0;
}

int main(int argc, char **argv)
{
    if (argc < 2) return run_all();
    if (strcmp(argv[1], "--list") == 0) {
        for (int i = 0; i < SUITES; i++) puts(suites[i].name);
        return 0;
    }
    if (argc > 2) cmocka_set_test_filter(argv[2]);
    for (int i = 0; i < SUITES; i++)
        if (strcmp(argv[1], suites[i].name) == 0) return suites[i].run(argc - 1, argv + 1);
    fprintf(stderr, "there is no suite %s\n", argv[1]);
    return 2;
}
