#pragma once
// What of the controller's state RSI's context sends beside positions: the operating mode (STATUS), the
// override (OV_PRO) and the contact input (DIGIN), each over a channel of the ETHERNET object.

#include <string>
#include <vector>

#include "drivers/kuka/krl/krl_rsi_set.h"
#include "drivers/kuka/krl/krl_template.h"

namespace cellcal::drivers::krl {

struct RsiStateSource {
  std::string tag;         ///< SEND tag
  const char* key;         ///< of [rsi], which names the tag
  const char* type;        ///< of the SEND element
  const char *rsi3, *rsi4; ///< ObjType in either release
  int type_id;             ///< ObjTypeID
  const char* output;      ///< name of its only output
  const char* says;        ///< for people
  const char* signal = "Int";        ///< of that output, in RSI 3's model
  const char* parameter = nullptr;   ///< the object's only one, number 1; none
  int value = 0;                     ///< its value
  const char* word = nullptr;        ///< likewise in words, where it is one of a list
};

/// Those whose tag is not empty; the first one has channel 1.
std::vector<RsiStateSource> state_sources(const RsiFilesConfig& config);
/// Name of the object in the context: "STATUS1" in RSI 3, "Status_1" in RSI 4.
std::string object_id(const RsiStateSource& source, int rsi_version);

void add_state(const RsiFilesConfig& config, Places& places);
/// Element and wiring. What is not sent is a warning: such sets go on working, mode and override
/// stay unknown.
void check_state(const RsiSet& set, const RsiContextFile* context);

}  // namespace cellcal::drivers::krl
