#include "daemon/main/notification.h"

#include "daemon/files/printable.h"

namespace cellcal::daemon {

std::string notification_of(const Status& status) {
  std::string words = to_string(status.phase);
  if (status.total > 0) {
    words += ", touch " + std::to_string(status.done) + " of " + std::to_string(status.total);
  }
  if (status.failure) words += ", " + describe(*status.failure);
  return "STATUS=" + printable(words);
}

}  // namespace cellcal::daemon
