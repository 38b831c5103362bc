#pragma once
// State of the controller sent by RSI's context in addition to positions: the operating mode (STATUS),
// the override (OV_PRO) and the contact input (DIGIN), each on a channel of the ETHERNET object.

#include <string>
#include <vector>

#include "drivers/kuka/krl/krl_files.h"
#include "drivers/kuka/krl/krl_rsi.h"

namespace cellcal::drivers::krl {

struct RsiStateSource {
  std::string tag;                  ///< SEND tag
  const char* key;                  ///< key of [rsi] with the tag
  const char* type;                 ///< of the SEND element
  const char *rsi3, *rsi4;          ///< ObjType in either release
  int type_id;                      ///< ObjTypeID
  const char* output;               ///< name of its only output
  const char* says;                 ///< display text
  const char* signal = "Int";       ///< of the output, in RSI 3's model
  const char* parameter = nullptr;  ///< name of the object's only parameter, number 1; null: none
  int value = 0;                    ///< its value
  const char* word = nullptr;       ///< its value as text, for enumerations
};

/// Sources with a tag; the first one has channel 1.
std::vector<RsiStateSource> state_sources(const RsiFilesConfig& config);
/// Name of the object in the context: "STATUS1" in RSI 3, "Status_1" in RSI 4.
std::string object_id(const RsiStateSource& source, int rsi_version);

void add_state(const RsiFilesConfig& config, Places& places);
/// Checks element and wiring. A missing value is a warning: such sets keep working, with unknown
/// mode and override.
void check_state(const RsiSet& set, const RsiContextFile* context);

}  // namespace cellcal::drivers::krl
