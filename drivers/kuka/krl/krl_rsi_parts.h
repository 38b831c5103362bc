#pragma once
// Parts of RSI's set of files: drawing, external axes, limits, state of the controller.

#include <cstddef>
#include <string>
#include <vector>

#include "drivers/kuka/krl/krl_findings.h"
#include "drivers/kuka/krl/krl_rsi.h"
#include "drivers/kuka/krl/krl_template.h"

namespace cellcal::drivers::krl {

// RSI 3's third file: the layout of the model in RSI-Visual. Ignored by the controller, but part of
// the unit.

/// cellcal_rsi.rsi.diagram, lines terminated by '\n'.
std::string rsi3_diagram(const RsiFilesConfig& config);

// External axes in RSI's set: in the packets, and the correction of a linear unit and of a positioner's axes
// by AXISCORREXT.

/// Channel of ETHERNET of E1's correction, after the six of the arm and STOP; E2 has the next.
inline constexpr int kTravelChannel = 8;

/// "AXISCORREXT1" in RSI 3, "AxisCorrExt_1" from RSI 4 on.
const char* travel_corrector(const RsiFilesConfig& config);
/// RECEIVE tag of the correction of an external axis: "EK.E1" of the first.
std::string travel_tag(const RsiFilesConfig& config, std::size_t axis);

/// Elements of external axes in the channel, and in the context AXISCORREXT with wiring, limits and
/// monitor. `context`: null if unreadable.
void check_travel(const RsiSet& set, const RsiContextFile* context);

// Limits set by CELLCAL_RSI at each start: AXISCORR's limits in the context are those of
// correction_limit_deg, symmetric and equal for all axes; the program narrows them to the software
// limit switches and the cell's ranges, relative to the current position.

/// Calls of CC_LOW and CC_HIGH, in the order of the axes, required in a program.
struct FenceLimit {
  std::string object;     ///< "AXISCORR1"
  std::string parameter;  ///< "LowerLimA1"
  std::string value;      ///< "CC_LOW($SOFTN_END[1],-155.1,$AXIS_ACT_MEAS.A1)"
  bool lower = true;
};
/// Ending of the functions for an external axis, in its unit: "_E1" of the first.
std::string travel_fence(std::size_t axis);
std::vector<FenceLimit> fence_limits(const RsiFilesConfig& config);

/// Limits set by a program have to be public in the context.
void check_public(const ControllerFiles& files, const RsiContextFile& context,
                  const RsiFilesConfig& config, Findings& findings);
/// Warns if a program sets none of them, or no range of the cell; refuses one that does not call
/// CC_FENCE before RSI_ON, sets some of them alone, or has ranges that differ from the
/// configuration.
void check_fence(const std::string& name, const std::string& text, const RsiFilesConfig& config,
                 Findings& findings);
/// Removes from statements of the fence the figures that check_fence() compares: correction_limit_deg
/// and ranges (LeaveOut of compare_program()).
void leave_out_limits(const std::string& scope, std::string& statement);

// State of the controller sent by RSI's context in addition to positions: the operating mode (STATUS),
// the override (OV_PRO) and the contact input (DIGIN), each on a channel of the ETHERNET object.

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

/// Places of each source, for the templates.
std::vector<Places> state_places(const RsiFilesConfig& config);
/// RSI 6: attribute of an input that comes from an output.
std::string signal_of(const RsiFilesConfig& config, const std::string& object,
                      const std::string& output);
/// From ETHERNET's.
std::string signal_of(const RsiFilesConfig& config, int channel);
/// Checks element and wiring. A missing value is a warning: such sets keep working, with unknown
/// mode and override.
void check_state(const RsiSet& set, const RsiContextFile* context);

}  // namespace cellcal::drivers::krl
