#pragma once
// Where the arm stands, from the controller through the daemon.

#include "daemon/cli/client.h"

namespace cellcal::daemon {

/// Prints the axis angles as the field of a taught sphere takes them. Throws what ask() throws.
int show_position(const Connection& daemon);

}  // namespace cellcal::daemon
