#pragma once

namespace cellcal::daemon::krl {

/// Identification of a tool.
struct ToolUsed {
  int number = 0;          ///< of TOOL_DATA; -1: written out in the text
  bool cells = false;      ///< the cell file's own, with its bending; otherwise stiff and as stated
  bool load_known = true;  ///< from LOAD_DATA; otherwise the cell's tool is assumed as the load
  int load = -1;           ///< of LOAD_DATA, where the program sets another than the tool's own
  bool operator==(const ToolUsed&) const = default;
};

}  // namespace cellcal::daemon::krl
