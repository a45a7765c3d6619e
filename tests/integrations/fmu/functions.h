/* A table of the functions of an FMU: out of a shared library, or linked with their prefix. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define MEMBER(f) TYPE_OF(f) *f;
typedef struct {
    FUNCTIONS(MEMBER)
} api;

#ifdef STATIC

#define JOIN(a, b) a##b
#define JOINED(a, b) JOIN(a, b)
#define DECLARE(f) extern TYPE_OF(f) JOINED(NAME, f);
FUNCTIONS(DECLARE)

static void load(api *all, const char *library)
{
#define ENTER(f) all->f = JOINED(NAME, f);
    (void)library;
    FUNCTIONS(ENTER)
}

#else

#include <dlfcn.h>

static void *symbol(void *library, const char *name)
{
    void *found = dlsym(library, name);
    if (found == NULL) {
        printf("FAIL: no function %s\n", name);
        exit(1);
    }
    return found;
}

static void load(api *all, const char *path)
{
    void *library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (library == NULL) {
        printf("FAIL: %s\n", dlerror());
        exit(1);
    }
#define ENTER(f) *(void **)&all->f = symbol(library, #f);
    FUNCTIONS(ENTER)
}

#endif
