#pragma once
// What the robot's thread may ask of the kernel: nothing that can make it sleep, but for the wait that it
// lives in.

#include <sys/types.h>

#include <boost/asio/io_context.hpp>
#include <vector>

#include "tests/drivers/cycle/syscall_trace.h"

namespace cellcal::test {

/// The kernel's number of the thread that runs it.
pid_t thread_of(boost::asio::io_context& context);

/// Fails the test for each kind of call that could sleep, and where the trace has seen no cycle at work, which sends
/// more than so often. The descriptors must still be open.
void expect_no_sleep(const std::vector<Syscall>& calls, int least_sent);

}  // namespace cellcal::test
