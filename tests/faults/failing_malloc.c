/* Preloaded: from the N-th call on, for OFFSTAGE_MALLOC_FAILS_AFTER=N, the next three calls of malloc for more than 64
   bytes fail. Then it works again, so that a message can be made. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <stdatomic.h>
#include <stdlib.h>

static atomic_long calls, failures;

void* malloc(size_t size) {
  static void* (*next)(size_t);
  static long first = -1;
  if (!next) {
    next = (void* (*)(size_t))dlsym(RTLD_NEXT, "malloc");
    const char* text = getenv("OFFSTAGE_MALLOC_FAILS_AFTER");
    first = text ? atol(text) : 0;
  }
  const long call = atomic_fetch_add(&calls, 1);
  if (first > 0 && call >= first && size > 64 && atomic_load(&failures) < 3) {
    atomic_fetch_add(&failures, 1);
    errno = ENOMEM;
    return NULL;
  }
  return next(size);
}
