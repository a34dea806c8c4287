// Lets one call of the system fail in a program that is started with this library in LD_PRELOAD.
//
// FAULT_CALL   write, sync, rename, close, truncate, open, unlink, or folder
// FAULT_NUMBER which of these calls fails, from 1; with FAULT_LASTING=1 that one and all later ones
// FAULT_ERROR  number of the error; 0: the write takes only a part of its bytes; -1: the process is killed before the call
// FAULT_CLOCK  if set, every look at the time of day finds another day
// FAULT_COUNTS file for the numbers of calls, one line for each kind
//
// Only files that are written count: not pipes, devices, folders that are read, nor files that are only read.
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <time.h>
#include <unistd.h>

enum kind { WRITE, SYNC, RENAME, CLOSE, TRUNCATE, OPEN, UNLINK, FOLDER, KINDS };
static const char *const NAMES[] = {"write", "sync", "rename", "close", "truncate", "open", "unlink", "folder"};
static atomic_long counts[KINDS];
static int chosen = -1, error, lasting;
static long number;

__attribute__((constructor)) static void begin(void) {
  const char *call = getenv("FAULT_CALL");
  for (int kind = 0; call && kind < KINDS; ++kind)
    if (!strcmp(call, NAMES[kind])) chosen = kind;
  number = getenv("FAULT_NUMBER") ? atol(getenv("FAULT_NUMBER")) : 0;
  error = getenv("FAULT_ERROR") ? atoi(getenv("FAULT_ERROR")) : 0;
  lasting = getenv("FAULT_LASTING") != NULL;
}

__attribute__((destructor)) static void end(void) {
  const char *path = getenv("FAULT_COUNTS");
  FILE *file = path ? fopen(path, "w") : NULL;
  for (int kind = 0; file && kind < KINDS; ++kind) fprintf(file, "%s %ld\n", NAMES[kind], atomic_load(&counts[kind]));
  if (file) fclose(file);
}

// Counts a call, and says whether it fails.
static int fails(enum kind kind) {
  long now = atomic_fetch_add(&counts[kind], 1) + 1;
  int fail = chosen == (int)kind && (now == number || (lasting && now > number));
  if (fail && error < 0) raise(SIGKILL);
  return fail;
}

static int is_written(int file) {
  struct stat data;
  int flags = fcntl(file, F_GETFL);
  // Messages are no files of a command.
  return file > 2 && flags >= 0 && (flags & O_ACCMODE) != O_RDONLY && !fstat(file, &data) && S_ISREG(data.st_mode);
}

#define REAL(name) ((__typeof__(&name))dlsym(RTLD_NEXT, #name))
#define FAIL_IF(condition, kind)    \
  if ((condition) && fails(kind)) { \
    errno = error;                  \
    return -1;                      \
  }
// A write fails, or takes half of its bytes.
#define FAIL_WRITE(file, count)           \
  if (is_written(file) && fails(WRITE)) { \
    if (error) {                          \
      errno = error;                      \
      return -1;                          \
    }                                     \
    if (count > 1) count /= 2;            \
  }

ssize_t write(int file, const void *bytes, size_t count) {
  FAIL_WRITE(file, count)
  return REAL(write)(file, bytes, count);
}
ssize_t pwrite(int file, const void *bytes, size_t count, off_t at) {
  FAIL_WRITE(file, count)
  return REAL(pwrite)(file, bytes, count, at);
}
ssize_t pwrite64(int file, const void *bytes, size_t count, off64_t at) {
  FAIL_WRITE(file, count)
  return REAL(pwrite64)(file, bytes, count, at);
}
ssize_t writev(int file, const struct iovec *parts, int count) {
  FAIL_WRITE(file, count)
  return REAL(writev)(file, parts, count);
}
int fsync(int file) {
  FAIL_IF(1, SYNC)
  return REAL(fsync)(file);
}
int fdatasync(int file) {
  FAIL_IF(1, SYNC)
  return REAL(fdatasync)(file);
}
int rename(const char *from, const char *to) {
  FAIL_IF(1, RENAME)
  return REAL(rename)(from, to);
}
int renameat(int from_folder, const char *from, int to_folder, const char *to) {
  FAIL_IF(1, RENAME)
  return REAL(renameat)(from_folder, from, to_folder, to);
}
int renameat2(int from_folder, const char *from, int to_folder, const char *to, unsigned flags) {
  FAIL_IF(1, RENAME)
  return REAL(renameat2)(from_folder, from, to_folder, to, flags);
}
int linkat(int from_folder, const char *from, int to_folder, const char *to, int flags) {
  FAIL_IF(1, RENAME)
  return REAL(linkat)(from_folder, from, to_folder, to, flags);
}
int ftruncate(int file, off_t length) {
  FAIL_IF(1, TRUNCATE)
  return REAL(ftruncate)(file, length);
}
int ftruncate64(int file, off64_t length) {
  FAIL_IF(1, TRUNCATE)
  return REAL(ftruncate64)(file, length);
}
int unlink(const char *path) {
  FAIL_IF(1, UNLINK)
  return REAL(unlink)(path);
}
int unlinkat(int folder, const char *path, int flags) {
  FAIL_IF(1, UNLINK)
  return REAL(unlinkat)(folder, path, flags);
}
int rmdir(const char *path) {
  FAIL_IF(1, UNLINK)
  return REAL(rmdir)(path);
}
int mkdir(const char *path, mode_t mode) {
  FAIL_IF(1, FOLDER)
  return REAL(mkdir)(path, mode);
}
// The file is closed, as on Linux.
int close(int file) {
  int fail = is_written(file) && fails(CLOSE);
  int result = REAL(close)(file);
  if (!fail) return result;
  errno = error;
  return -1;
}
#define OPEN_AS(name, arguments, call)                    \
  int name arguments {                                    \
    mode_t mode = 0;                                      \
    if (flags & (O_CREAT | O_TMPFILE)) {                  \
      va_list rest;                                       \
      va_start(rest, flags);                              \
      mode = va_arg(rest, mode_t);                        \
      va_end(rest);                                       \
    }                                                     \
    FAIL_IF((flags & O_ACCMODE) != O_RDONLY, OPEN)        \
    return call;                                          \
  }
OPEN_AS(open, (const char *path, int flags, ...), REAL(open)(path, flags, mode))
OPEN_AS(open64, (const char *path, int flags, ...), REAL(open64)(path, flags, mode))
OPEN_AS(openat, (int folder, const char *path, int flags, ...), REAL(openat)(folder, path, flags, mode))
OPEN_AS(openat64, (int folder, const char *path, int flags, ...), REAL(openat64)(folder, path, flags, mode))
int clock_gettime(clockid_t clock, struct timespec *time) {
  static atomic_long looks;
  int result = REAL(clock_gettime)(clock, time);
  if (clock == CLOCK_REALTIME && getenv("FAULT_CLOCK")) time->tv_sec += 86400 * (atomic_fetch_add(&looks, 1) % 3 - 1);
  return result;
}
