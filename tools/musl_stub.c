/* What Debian's libstdc++ and libgcc, which were built for glibc, ask of it and musl lacks. Linked into tests of the
 * platform only (tools/toolchains/musl.cmake): CaDiCaL throws nothing but for want of memory, and that ends the program
 * here. */
#include <stdint.h>
#include <stdlib.h>

extern char __libc_single_threaded;
int _dl_find_object(void *address, void *result);
uint32_t arc4random(void);

/* 0: there may be threads, so that counts of references are atomic. */
char __libc_single_threaded = 0;

/* Where an object's tables of unwinding lie. -1: unknown. */
int _dl_find_object(void *address, void *result)
{
    (void)address, (void)result;
    return -1;
}

/* For std::random_device, which nothing here uses. */
uint32_t arc4random(void) { abort(); }
