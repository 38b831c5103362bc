#pragma once
// Frames set on the controller through the daemon. Each returns its exit status and throws when it failed.

#include "daemon/cli/client.h"

namespace cellcal::daemon {

struct FramesCommand;

struct SendFrames {
  bool send = false, confirm = false, list = false;
  bool other_calibration = false;  ///< also one that is not in use on the daemon
  int restore = 0;                 ///< number of --sent; 0: none
};

/// Reads all frames, shows old and new, asks, sets them. Ends with the first that was not set, and says which were.
int send_frames(const Connection& daemon, const FramesCommand& frames, const SendFrames& how);
int list_sent_frames(const Connection& daemon);
int restore_frame(const Connection& daemon, const SendFrames& how);

// Where the arm stands, from the controller through the daemon.

/// Prints the axis angles as the field of a taught sphere takes them. Throws what ask() throws.
int show_position(const Connection& daemon);

}  // namespace cellcal::daemon
