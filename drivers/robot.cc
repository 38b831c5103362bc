#include "drivers/robot.h"

namespace cellcal::drivers {

const char* to_string(OperatingMode mode) {
  switch (mode) {
    case OperatingMode::kT1: return "T1";
    case OperatingMode::kT2: return "T2";
    case OperatingMode::kAut: return "AUT";
    case OperatingMode::kExt: return "EXT";
    case OperatingMode::kUnknown: break;
  }
  return "unknown";
}

const char* to_string(InputPath path) {
  switch (path) {
    case InputPath::kUntold: return "not sent";
    case InputPath::kUnproven: return "unproven";
    case InputPath::kFollows: return "follows";
    case InputPath::kMissed: return "missed a touch";
    case InputPath::kNone: break;
  }
  return "none";
}

const char* to_string(ControllerRequest request) {
  switch (request) {
    case ControllerRequest::kBrakeTest: return "brake test";
    case ControllerRequest::kMasteringTest: return "mastering test";
    case ControllerRequest::kCollision: return "collision detected";
    case ControllerRequest::kNone: break;
  }
  return "nothing";
}

const char* to_string(MoveOutcome outcome) {
  switch (outcome) {
    case MoveOutcome::kArrived: return "arrived";
    case MoveOutcome::kContact: return "contact";
    case MoveOutcome::kRevoked: return "revoked";
    case MoveOutcome::kStopped: return "stopped";
    case MoveOutcome::kUnexpectedContact: return "unexpected contact";
    case MoveOutcome::kStillInContact: return "still in contact";
    case MoveOutcome::kContactSilent: return "contact sensor silent";
    case MoveOutcome::kRobotSilent: return "robot silent";
    case MoveOutcome::kRefused: return "refused";
    case MoveOutcome::kNotFollowing: return "not following";
  }
  return "unknown";
}

}  // namespace cellcal::drivers
