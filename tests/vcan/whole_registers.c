/* Preloaded into user-mode Linux 6.1 where the processor has more registers than that kernel knows of (AMX).

It restores a process' vector registers by PTRACE_SETREGSET with the 2696 bytes up to AVX-512, and Linux refuses
(EFAULT) whatever is not the size of all (ptrace's xstateregs_set, Linux 5.14 and newer). Here the rest is added,
as it is in the process. AMX itself stays unused: a process must ask for it, and user-mode Linux does not know how. */

#define _GNU_SOURCE
#include <elf.h>
#include <stdarg.h>
#include <string.h>
#include <sys/ptrace.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

static long called(long request, long process, void *address, void *data)
{
    return syscall(SYS_ptrace, request, process, address, data);
}

long ptrace(enum __ptrace_request request, ...)
{
    va_list given;
    va_start(given, request);
    long process = va_arg(given, pid_t);
    void *address = va_arg(given, void *);
    void *data = va_arg(given, void *);
    va_end(given);
    if (request == PTRACE_SETREGSET && (long)address == NT_X86_XSTATE) {
        static __thread unsigned char registers[1 << 16];
        struct iovec *known = data, all = {registers, sizeof registers};
        if (called(PTRACE_GETREGSET, process, address, &all) == 0 && all.iov_len > known->iov_len) {
            memcpy(registers, known->iov_base, known->iov_len);
            return called(PTRACE_SETREGSET, process, address, &all);
        }
    }
    if (request == PTRACE_PEEKTEXT || request == PTRACE_PEEKDATA || request == PTRACE_PEEKUSER) {
        long value = 0; /* the system call has an address for it, glibc returns it */
        return called(request, process, address, &value) < 0 ? -1 : value;
    }
    return called(request, process, address, data);
}
