#pragma once

#ifdef __cplusplus
extern "C" {
#endif

/* Output baud rate of a terminal; -1: not a terminal. */
int baud_of(int fd);

#ifdef __cplusplus
}
#endif
