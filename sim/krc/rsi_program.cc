#include "sim/krc/rsi_program.h"

#include <algorithm>

#include "drivers/kuka/wire/wire_axes.h"

namespace cellcal::sim {

namespace {

using krl::Value;

constexpr const char* kName = "cellcal_rsi.src";
constexpr const char* kPlain = "DEF CELLCAL_RSI ( )\n  RSI_MOVECORR()\nEND\n";
constexpr const char* kMoveCorr = "DEF RSI_MOVECORR ( )\n  WAIT FOR RSI_ENDED\nEND\n";

constexpr const char* kRsiVariables = R"(
ENUM RSI_MODE_T ABSOLUTE,RELATIVE
ENUM RSI_CYCLE_T IPO,IPO_FAST
BOOL RSI_ENDED
CONST INT RSIOK=0
E6AXIS $AXIS_ACT_MEAS
REAL $SOFTN_END[12],$SOFTP_END[12]
FRAME $TOOL,$BASE
LOAD $LOAD
FRAME TOOL_DATA[128],BASE_DATA[128]
LOAD LOAD_DATA[128]
EXTFCT INT RSI_RESET()
EXTFCT INT RSI_CREATE(CHAR[] :IN,INT :OUT,BOOL :IN)
EXTFCT INT RSI_SETPUBLICPAR(INT :IN,CHAR[] :IN,CHAR[] :IN,REAL :IN)
EXTFCT INT RSI_ON(RSI_MODE_T :IN,RSI_CYCLE_T :IN)
EXTFCT INT RSI_OFF()
EXTFCT INT RSI_DELETE(INT :IN)
EXTFCT INT RSI_LOAD(CHAR[] :IN)
EXTFCT INT RSI_ACTIVATE(CHAR[] :IN)
EXTFCT INT RSI_SETPARAMETER(CHAR[] :IN,CHAR[] :IN,CHAR[] :IN,REAL :IN)
EXTFCT INT RSI_PROCESS_ON(RSI_MODE_T :IN)
EXTFCT INT RSI_PROCESS_OFF()
)";

void fill(Value& value, const std::vector<double>& numbers, double otherwise) {
  for (std::size_t i = 0; i < value.parts.size(); ++i)
    value.parts[i].set(i < numbers.size() ? numbers[i] : otherwise);
}

}  // namespace

RsiProgram::RsiProgram(const std::string& text)
    : program_({{kName, text.empty() ? kPlain : text}, {"rsi_movecorr.src", kMoveCorr}},
               kRsiVariables),
      robot_(program_, this) {
  using Arguments = std::span<Value* const>;
  const auto bind = [this](const char* name, std::function<void(Arguments)> function) {
    program_.bind(name, [function, &type = program_.type("INT")](Arguments a) {
      function(a);
      Value fine(type);
      fine.set_whole(0);
      return fine;
    });
  };
  for (const char* name : {"TOOL_DATA", "BASE_DATA", "LOAD_DATA"}) program_[name].set_all(0.0);
  for (const char* name :
       {"RSI_RESET", "RSI_OFF", "RSI_DELETE", "RSI_LOAD", "RSI_ACTIVATE", "RSI_PROCESS_OFF"})
    bind(name, [](Arguments) {});
  bind("RSI_CREATE", [](Arguments a) { a[1]->set_whole(1); });
  bind("RSI_SETPUBLICPAR", [this](Arguments a) { set_limit(a[2]->text(), a[3]->r); });
  bind("RSI_SETPARAMETER", [this](Arguments a) { set_limit(a[2]->text(), a[3]->r); });
  for (const char* name : {"RSI_ON", "RSI_PROCESS_ON"})
    bind(name, [this](Arguments a) { start_->relative = a[0]->i == 2; });
}

/// "LowerLimA1", "UpperLimE1"
void RsiProgram::set_limit(const std::string& parameter, double value) {
  const bool lower = parameter.starts_with("LowerLim");
  const bool external = parameter.size() == 10 && parameter[8] == 'E';
  if (!(lower || parameter.starts_with("UpperLim")) || parameter.size() != 10 ||
      !(external || parameter[8] == 'A'))
    throw krl::RunError("RSI: no parameter " + parameter);
  const auto axis =
      static_cast<std::size_t>(parameter[9] - '1') + (external ? drivers::kArmAxes : 0);
  std::vector<double>& limits = lower ? start_->low_deg : start_->high_deg;
  if (axis < limits.size()) limits[axis] = value;
}

bool RsiProgram::start(const std::vector<double>& actual_deg,
                       const std::vector<double>& soft_min_deg,
                       const std::vector<double>& soft_max_deg, RsiStart& start) {
  constexpr double kNone = 1e6;
  fill(program_["$AXIS_ACT_MEAS"], actual_deg, 0.0);
  fill(program_["$SOFTN_END"], soft_min_deg, -kNone);
  fill(program_["$SOFTP_END"], soft_max_deg, kNone);
  program_["RSI_ENDED"].set_whole(0);
  start_ = &start;
  robot_.select("CELLCAL_RSI");
  robot_.run(0.0);
  return robot_.running() && robot_.is_in("RSI_MOVECORR");
}

void RsiProgram::finish() {
  program_["RSI_ENDED"].set_whole(1);
  robot_.run(0.0);
}

}  // namespace cellcal::sim
