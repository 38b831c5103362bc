#pragma once
// Sentences of faults and refusals, with the remedy. Not for the cycle.

#include <string>

#include "drivers/contact/contact_facts.h"

namespace cellcal::drivers {

ContactLink link_of(const ContactFacts& facts);
std::string words_of(const ContactFacts& facts);
ContactStatus status_of(const ContactFacts& facts);
ArmResult result_of(const ArmAnswer& answer);

}  // namespace cellcal::drivers
