/* A library for LD_PRELOAD that stands between a process and one folder.

   It numbers the calls that change the folder or make it durable, and can record them, kill the process just before
   (or in the middle of) the N-th, let it fail, or leave out every synchronisation. A process arms it by
   recorder_arm(), or from its start by the environment:

   FAULT_FOLDER      absolute path; calls elsewhere pass through
   FAULT_TRACE       file, outside the folder, to which each call that succeeded is appended (see struct record)
   FAULT_ACTION      kill | tear (kill in the middle of a write) | fail | short (a write writes half) |
                     drop (a synchronisation that FAULT_OPERATIONS names does nothing)
   FAULT_AT          number of the call, from 1, among those that FAULT_OPERATIONS names
   FAULT_OPERATIONS  letters of enum operation; all when empty
   FAULT_ERROR       errno of a failure
   FAULT_SPARED      endings of files of the folder whose calls pass through too, as in ".lock .log"
   FAULT_STICKY      1: every later call that FAULT_OPERATIONS names fails too

   One thread is supposed to write, as in the product. Calls go to the kernel directly, not to another library. */

#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/syscall.h>
#include <unistd.h>

enum operation {
    CREATE = 'c', WRITE = 'w', TRUNCATE = 't', RESERVE = 'a', SYNC = 's', SYNC_DATA = 'd', RENAME = 'r', UNLINK = 'u',
    MAKE_FOLDER = 'm', LINK = 'l',
    /* recorded for the replay's sake, but never counted: */
    OPEN = 'o', CLOSE = 'x', MARK = 'k'
};

struct record { /* followed by the two paths and, of a write, its bytes */
    int32_t operation, descriptor;
    int64_t offset, length;
    int32_t path_length, other_length;
};

#define DESCRIPTORS 65536

static char folder[4096], operations[64], action[16], spared[256];
static size_t folder_length;
static int trace = -1, failure, sticky;
static long count, at;
static char watched[DESCRIPTORS]; /* descriptors of files in the folder */

static const char *setting(const char *name)
{
    const char *value = getenv(name);
    return value ? value : "";
}

__attribute__((constructor)) void recorder_arm(void)
{
    strncpy(folder, setting("FAULT_FOLDER"), sizeof folder - 1);
    strncpy(operations, setting("FAULT_OPERATIONS"), sizeof operations - 1);
    strncpy(action, setting("FAULT_ACTION"), sizeof action - 1);
    strncpy(spared, setting("FAULT_SPARED"), sizeof spared - 1);
    folder_length = strlen(folder);
    at = atol(setting("FAULT_AT"));
    failure = atoi(setting("FAULT_ERROR"));
    sticky = atoi(setting("FAULT_STICKY"));
    count = 0;
    if (*setting("FAULT_TRACE"))
        trace = syscall(SYS_openat, AT_FDCWD, setting("FAULT_TRACE"), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
}

static int is_spared(const char *path)
{
    char endings[sizeof spared], *ending, *rest;
    strcpy(endings, spared);
    for (ending = strtok_r(endings, " ", &rest); ending; ending = strtok_r(NULL, " ", &rest))
        if (strlen(path) >= strlen(ending) && !strcmp(path + strlen(path) - strlen(ending), ending))
            return 1;
    return 0;
}

static int inside(const char *path)
{
    return folder_length && !strncmp(path, folder, folder_length) &&
           (path[folder_length] == '/' || !path[folder_length]) && !is_spared(path);
}

static int watching(int descriptor)
{
    return descriptor >= 0 && descriptor < DESCRIPTORS && watched[descriptor];
}

static void record(int operation, int descriptor, int64_t offset, int64_t length, const char *path, const char *other,
                   const void *data)
{
    struct record head = {operation, descriptor, offset, length, strlen(path), strlen(other)};
    int saved = errno;
    if (trace < 0 || !folder_length)
        return;
    syscall(SYS_write, trace, &head, sizeof head);
    syscall(SYS_write, trace, path, strlen(path));
    syscall(SYS_write, trace, other, strlen(other));
    if (data)
        syscall(SYS_write, trace, data, length);
    errno = saved;
}

/* A word of the process itself between its calls: what it has acknowledged. */
void recorder_mark(const char *text)
{
    record(MARK, -1, 0, 0, text, "", NULL);
}

static void die(void)
{
    syscall(SYS_kill, getpid(), SIGKILL);
}

/* What is to become of the next call: 0, or the errno that it fails with. A write may be made shorter. */
static int before(int operation, size_t *length)
{
    int due;
    if (*operations && !strchr(operations, operation))
        return 0;
    due = ++count == at;
    if (due && (!strcmp(action, "kill") || (!strcmp(action, "tear") && operation != WRITE)))
        die();
    if (due && operation == WRITE && (!strcmp(action, "tear") || !strcmp(action, "short")))
        *length = (*length + 1) / 2;
    if (!strcmp(action, "fail") && (due || (sticky && count > at)))
        return failure;
    return 0;
}

#define FAIL(error) do { errno = (error); return -1; } while (0)

static int watched_open(const char *path, int flags, mode_t mode)
{
    int changes, error, descriptor;
    size_t nothing = 0;
    if (!inside(path))
        return syscall(SYS_openat, AT_FDCWD, path, flags, mode);
    changes = (flags & O_TRUNC) || ((flags & O_CREAT) && syscall(SYS_faccessat, AT_FDCWD, path, F_OK));
    if (changes && (error = before(CREATE, &nothing)))
        FAIL(error);
    descriptor = syscall(SYS_openat, AT_FDCWD, path, flags, mode);
    if (descriptor >= 0 && descriptor < DESCRIPTORS) {
        watched[descriptor] = 1;
        record(changes ? CREATE : OPEN, descriptor, 0, 0, path, "", NULL);
    }
    return descriptor;
}

static mode_t mode_of(int flags, va_list arguments)
{
    return flags & (O_CREAT | O_TMPFILE) ? va_arg(arguments, mode_t) : 0;
}

#define OPEN_FUNCTION(name)                                                                                            \
    int name(const char *path, int flags, ...)                                                                         \
    {                                                                                                                  \
        va_list arguments;                                                                                             \
        mode_t mode;                                                                                                   \
        va_start(arguments, flags);                                                                                    \
        mode = mode_of(flags, arguments);                                                                              \
        va_end(arguments);                                                                                             \
        return watched_open(path, flags, mode);                                                                        \
    }
OPEN_FUNCTION(open)
OPEN_FUNCTION(open64)

int close(int descriptor)
{
    if (watching(descriptor)) {
        watched[descriptor] = 0;
        record(CLOSE, descriptor, 0, 0, "", "", NULL);
    }
    return syscall(SYS_close, descriptor);
}

static ssize_t watched_write(int descriptor, const void *data, size_t length, off_t offset)
{
    ssize_t written;
    int error = before(WRITE, &length), torn = !strcmp(action, "tear") && count == at;
    if (error)
        FAIL(error);
    written = syscall(SYS_pwrite64, descriptor, data, length, offset);
    if (written > 0)
        record(WRITE, descriptor, offset, written, "", "", data);
    if (torn)
        die();
    return written;
}

ssize_t pwrite(int descriptor, const void *data, size_t length, off_t offset)
{
    if (!watching(descriptor))
        return syscall(SYS_pwrite64, descriptor, data, length, offset);
    return watched_write(descriptor, data, length, offset);
}
ssize_t pwrite64(int, const void *, size_t, off_t) __attribute__((alias("pwrite")));

ssize_t write(int descriptor, const void *data, size_t length)
{
    ssize_t written;
    if (!watching(descriptor))
        return syscall(SYS_write, descriptor, data, length);
    written = watched_write(descriptor, data, length, lseek(descriptor, 0, SEEK_CUR));
    if (written > 0)
        lseek(descriptor, written, SEEK_CUR);
    return written;
}

int ftruncate(int descriptor, off_t length)
{
    size_t nothing = 0;
    int error, result;
    if (watching(descriptor) && (error = before(TRUNCATE, &nothing)))
        FAIL(error);
    result = syscall(SYS_ftruncate, descriptor, length);
    if (!result && watching(descriptor))
        record(TRUNCATE, descriptor, 0, length, "", "", NULL);
    return result;
}
int ftruncate64(int, off_t) __attribute__((alias("ftruncate")));

int posix_fallocate(int descriptor, off_t offset, off_t length) /* gives the errno, does not set it */
{
    size_t nothing = 0;
    int error;
    if (watching(descriptor) && (error = before(RESERVE, &nothing)))
        return error;
    if (syscall(SYS_fallocate, descriptor, 0, offset, length))
        return errno;
    if (watching(descriptor))
        record(RESERVE, descriptor, offset, length, "", "", NULL);
    return 0;
}
int posix_fallocate64(int, off_t, off_t) __attribute__((alias("posix_fallocate")));

static int synchronise(int operation, long call, int descriptor)
{
    size_t nothing = 0;
    int error, result;
    if (!watching(descriptor))
        return syscall(call, descriptor);
    if ((error = before(operation, &nothing)))
        FAIL(error);
    if (!strcmp(action, "drop") && (!*operations || strchr(operations, operation)))
        return 0;
    result = syscall(call, descriptor);
    if (!result)
        record(operation, descriptor, 0, 0, "", "", NULL);
    return result;
}

int fsync(int descriptor) { return synchronise(SYNC, SYS_fsync, descriptor); }
int fdatasync(int descriptor) { return synchronise(SYNC_DATA, SYS_fdatasync, descriptor); }

int rename(const char *old, const char *new)
{
    size_t nothing = 0;
    int error, ours = inside(old) || inside(new), result;
    if (ours && (error = before(RENAME, &nothing)))
        FAIL(error);
    result = syscall(SYS_renameat2, AT_FDCWD, old, AT_FDCWD, new, 0);
    if (!result && ours)
        record(RENAME, -1, 0, 0, old, new, NULL);
    return result;
}

int link(const char *old, const char *new)
{
    size_t nothing = 0;
    int error, ours = inside(old) || inside(new), result;
    if (ours && (error = before(LINK, &nothing)))
        FAIL(error);
    result = syscall(SYS_linkat, AT_FDCWD, old, AT_FDCWD, new, 0);
    if (!result && ours)
        record(LINK, -1, 0, 0, old, new, NULL);
    return result;
}

int unlink(const char *path)
{
    size_t nothing = 0;
    int error, result;
    /* removing what is not there changes nothing: not counted */
    if (inside(path) && !syscall(SYS_faccessat, AT_FDCWD, path, F_OK) && (error = before(UNLINK, &nothing)))
        FAIL(error);
    result = syscall(SYS_unlinkat, AT_FDCWD, path, 0);
    if (!result && inside(path))
        record(UNLINK, -1, 0, 0, path, "", NULL);
    return result;
}

int mkdir(const char *path, mode_t mode)
{
    size_t nothing = 0;
    int error, result;
    if (inside(path) && syscall(SYS_faccessat, AT_FDCWD, path, F_OK) && (error = before(MAKE_FOLDER, &nothing)))
        FAIL(error);
    result = syscall(SYS_mkdirat, AT_FDCWD, path, mode);
    if (!result && inside(path))
        record(MAKE_FOLDER, -1, 0, 0, path, "", NULL);
    return result;
}
