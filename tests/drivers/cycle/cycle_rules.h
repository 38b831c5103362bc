#pragma once
// System calls allowed on the robot's thread: none that can sleep, except for its main wait.

#include <sys/types.h>

#include <boost/asio/io_context.hpp>
#include <vector>

#include "tests/drivers/cycle/syscall_trace.h"

namespace cellcal::test {

/// The kernel's id of the thread that runs it.
pid_t thread_of(boost::asio::io_context& context);

/// Fails the test for each kind of call that could sleep, and if the trace contains no active cycle, i.e. at most
/// `least_sent` sends. The descriptors must still be open.
void expect_no_sleep(const std::vector<Syscall>& calls, int least_sent);

}  // namespace cellcal::test
