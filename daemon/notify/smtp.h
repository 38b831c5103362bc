#pragma once
// One mail handed to a mail server (SMTP, RFC 5321).

#include <string>

#include "daemon/config/notify_config.h"
#include "daemon/notify/transfer.h"

namespace cellcal::daemon {

/// `mail` is the whole text with lines that end in \n. `password` goes over TLS alone: with a user the server has to offer it.
/// Where some of the addresses were answered with 4yz it is to be tried again for those (`left`) alone: the others have it.
Delivery send_by_smtp(const MailConfig& config, const MailServer& server,
                      const std::string& password, const std::string& mail);

}  // namespace cellcal::daemon
