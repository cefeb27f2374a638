/* SPDX-License-Identifier: BSD-3-Clause */
/* Preloaded into a program, it makes allocations fail from the start of main() on. By environment variables:
   DELASSUS_FAIL_AT=N         the N-th allocation fails, once
   DELASSUS_FAIL_ABOVE=BYTES  whatever would take what main() holds above that size fails: a machine with so much memory
   DELASSUS_FAIL_IN=WORD      only in a program whose first argument is this one
   DELASSUS_FAIL_NOT_IN=NAME  the N-th is not one for which a library asks whose file name holds this one
   DELASSUS_FAIL_REPORT=FILE  at exit, one line with the number of allocations and the largest size goes to the file */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <execinfo.h>
#include <malloc.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#pragma GCC visibility push(default)

extern void* __libc_malloc(size_t size);
extern void* __libc_calloc(size_t count, size_t size);
extern void* __libc_realloc(void* pointer, size_t size);
extern void* __libc_memalign(size_t alignment, size_t size);
extern void __libc_free(void* pointer);

static atomic_int armed;
static atomic_long allocations, held, most_held, fail_at;
static long fail_above;
static const char *report_file, *spared;

/* Whether the library that is spared is among the callers, libc's functions that it calls included. */
static int is_spared(void) {
    void* frames[64];
    Dl_info place;
    if (!spared) return 0;
    const int count = backtrace(frames, 64);
    for (int k = 0; k < count; ++k)
        if (dladdr(frames[k], &place) && place.dli_fname && strstr(place.dli_fname, spared)) return 1;
    return 0;
}

/* The next allocation is tried where this one is spared. */
static int fails(size_t size) {
    if (!atomic_load(&armed)) return 0;
    const long number = atomic_fetch_add(&allocations, 1) + 1;
    const int above = fail_above > 0 && atomic_load(&held) + (long)size > fail_above;
    if (number != atomic_load(&fail_at) && !above) return 0;
    if (!above && is_spared()) {
        atomic_store(&fail_at, number + 1);
        return 0;
    }
    errno = ENOMEM;
    return 1;
}

static void* taken(void* pointer) {
    if (!pointer || !atomic_load(&armed)) return pointer;
    const long now = atomic_fetch_add(&held, (long)malloc_usable_size(pointer)) + (long)malloc_usable_size(pointer);
    long most = atomic_load(&most_held);
    while (now > most && !atomic_compare_exchange_weak(&most_held, &most, now)) {
    }
    return pointer;
}

void* malloc(size_t size) {
    return fails(size) ? NULL : taken(__libc_malloc(size));
}
void* calloc(size_t count, size_t size) {
    return fails(count * size) ? NULL : taken(__libc_calloc(count, size));
}
void* memalign(size_t alignment, size_t size) {
    return fails(size) ? NULL : taken(__libc_memalign(alignment, size));
}
void* aligned_alloc(size_t alignment, size_t size) {
    return memalign(alignment, size);
}
int posix_memalign(void** pointer, size_t alignment, size_t size) {
    void* made = memalign(alignment, size);
    if (!made) return ENOMEM;
    *pointer = made;
    return 0;
}
void free(void* pointer) {
    if (pointer && atomic_load(&armed)) atomic_fetch_sub(&held, (long)malloc_usable_size(pointer));
    __libc_free(pointer);
}
void* realloc(void* pointer, size_t size) {
    if (fails(size)) return NULL;
    if (pointer && atomic_load(&armed)) atomic_fetch_sub(&held, (long)malloc_usable_size(pointer));
    return taken(__libc_realloc(pointer, size));
}

static void report(void) {
    atomic_store(&armed, 0);
    FILE* file = fopen(report_file, "a");
    if (!file) return;
    fprintf(file, "%ld %ld\n", atomic_load(&allocations), atomic_load(&most_held));
    fclose(file);
}

static int (*real_main)(int, char**, char**);

static int armed_main(int count, char** arguments, char** environment) {
    const char* only_in = getenv("DELASSUS_FAIL_IN");
    const char* at = getenv("DELASSUS_FAIL_AT");
    const char* above = getenv("DELASSUS_FAIL_ABOVE");
    report_file = getenv("DELASSUS_FAIL_REPORT");
    if (!only_in || (count > 1 && strcmp(arguments[1], only_in) == 0)) {
        spared = getenv("DELASSUS_FAIL_NOT_IN");
        if (at) atomic_store(&fail_at, atol(at));
        if (above) fail_above = atol(above);
        if (report_file) atexit(report);
        is_spared();  // the first look loads the unwinder
        atomic_store(&armed, 1);
    }
    return real_main(count, arguments, environment);
}

int __libc_start_main(int (*main)(int, char**, char**), int count, char** arguments, void (*init)(void),
                      void (*fini)(void), void (*rtld_fini)(void), void* stack_end) {
    int (*start)(int (*)(int, char**, char**), int, char**, void (*)(void), void (*)(void), void (*)(void), void*);
    void* symbol = dlsym(RTLD_NEXT, "__libc_start_main");
    memcpy(&start, &symbol, sizeof start);
    real_main = main;
    return start(armed_main, count, arguments, init, fini, rtld_fini, stack_end);
}
