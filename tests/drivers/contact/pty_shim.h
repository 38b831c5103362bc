/* What pty_shim, preloaded, can make a port do. Called through dlsym(RTLD_DEFAULT, ...). */
#pragma once

#ifdef __cplusplus
extern "C" {
#endif

enum pty_shim_adapter_kind {
  PTY_SHIM_NONE,               /* as the kernel has it */
  PTY_SHIM_TAKES_LOW_LATENCY,  /* an adapter whose low-latency flag can be set */
  PTY_SHIM_REFUSES_LOW_LATENCY /* one where it cannot, with FTDI's timer of 16 ms */
};

void pty_shim_adapter(enum pty_shim_adapter_kind kind);
/* The flags that were set last on such an adapter. */
int pty_shim_serial_flags(void);
/* The next reads of the port fail with this error. */
void pty_shim_fail_reads(int count, int error);
/* The next writes to the port take half of the bytes. */
void pty_shim_cut_writes(int count);

#ifdef __cplusplus
}
#endif
