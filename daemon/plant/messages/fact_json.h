#pragma once
// A fact as JSON, "cellcal.plant/1", both ways by one table.

#include <string>
#include <string_view>

#include "daemon/plant/messages/fact.h"

namespace cellcal::daemon::plant {

/// Larger messages are refused unread; a certificate with its raw rows has some 2 MB.
inline constexpr std::size_t kLargestMessage = std::size_t{8} << 20;

/// The body alone, as it waits in an outbox until the rest is known.
std::string body_to_json(const FactBody& body);
/// `kind` as kind_of() gave it. Throws calib::FileError.
FactBody body_from_json(std::string_view kind, std::string_view json);

/// One line. Bytes that are not UTF-8 are replaced, but in certificates' files.
std::string to_json(const Fact& fact);
/// Throws calib::FileError, which names the key; also where the topic is another's than the message says.
Fact fact_from_json(std::string_view json, const Topic& topic);

}  // namespace cellcal::daemon::plant
