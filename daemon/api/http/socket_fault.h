#pragma once

#include "calib/words/phrase.h"
#include "daemon/api/http/http.h"

namespace cellcal::daemon {

/// A SocketError whose sentence is in the catalogues: path, reason and remedy, in English by what().
struct SocketFault : SocketError {
  explicit SocketFault(const calib::Phrase& sentence, bool permission = false)
      : SocketError(calib::words(sentence)), phrase(sentence), denied(permission) {}
  calib::Phrase phrase;
  bool denied;  ///< no permission for the socket
};

}  // namespace cellcal::daemon
