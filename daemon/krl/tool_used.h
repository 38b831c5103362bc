#pragma once

namespace cellcal::daemon::krl {

/// What a tool was taken for.
struct ToolUsed {
  int number = 0;          ///< of TOOL_DATA; -1: as it stands in the text
  bool cells = false;      ///< the cell file's own, with its bending; else stiff and as stated
  bool load_known = true;  ///< by LOAD_DATA; else the joints are taken to bear the cell's tool
};

}  // namespace cellcal::daemon::krl
