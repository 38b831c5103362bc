#pragma once
// The text of a mail, and its way through the system's own program (sendmail's command line, which postfix, exim, msmtp and others have).
//
// Nothing of the daemon is handed down to the program but an empty environment's PATH: no socket, no serial port, no
// blocked signal. It is waited for, and ended where it does not end by itself.

#include <chrono>
#include <string>

#include "daemon/config/notify_config.h"
#include "daemon/unattended/message.h"
#include "daemon/unattended/transfer.h"

namespace cellcal::daemon {

/// The whole mail, lines ended by \n as sendmail takes them. `date`: RFC 5322. `id`: of letters and digits, another for each mail.
std::string mail_text(const MailConfig& config, const Message& message, const std::string& date,
                      const std::string& id);

Delivery send_mail(const MailConfig& config, const std::string& mail,
                   std::chrono::milliseconds longest = std::chrono::seconds(30));

// One mail handed to a mail server (SMTP, RFC 5321).

/// `mail` is the whole text with lines that end in \n. `password` goes over TLS alone: with a user the server has to offer it.
/// Where some of the addresses were answered with 4yz it is to be tried again for those (`left`) alone: the others have it.
Delivery send_by_smtp(const MailConfig& config, const MailServer& server,
                      const std::string& password, const std::string& mail);

}  // namespace cellcal::daemon
