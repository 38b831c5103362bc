#include <cmath>
#include <numbers>

#include "sim/krl/program.h"

namespace cellcal::sim::krl {

const std::string_view kSystem = R"(
STRUC FRAME REAL X,Y,Z,A,B,C
STRUC POS REAL X,Y,Z,A,B,C,INT S,T
STRUC E6POS REAL X,Y,Z,A,B,C,INT S,T,REAL E1,E2,E3,E4,E5,E6
STRUC AXIS REAL A1,A2,A3,A4,A5,A6
STRUC E6AXIS REAL A1,A2,A3,A4,A5,A6,E1,E2,E3,E4,E5,E6
STRUC INERTIA REAL X,Y,Z
STRUC LOAD REAL M,FRAME CM,INERTIA J
STRUC CP REAL CP,ORI1,ORI2
STRUC DATE INT CSEC,SEC,MIN,HOUR,DAY,MONTH,YEAR
STRUC STATE_T INT RET1,HITS,LENGTH
ENUM MODUS_T SYNC,ASYNC,ABS,COND,SEQ
ENUM PRO_STATE P_FREE,P_RESET,P_ACTIVE,P_STOP,P_END
ENUM MODE_OP T1,T2,AUT,EX
ENUM IPO_MODE BASE,TCP
ENUM IPO_M_T NONE,TCP,BASE
ENUM ORI_TYPE VAR,CONSTANT,JOINT
ENUM CIRC_TYPE BASE,PATH
ENUM CASE_SENSE_T CASE_SENS,NOT_CASE_SENS
ENUM BAS_COMMAND INITMOV,ACC_CP,ACC_PTP,VEL_CP,VEL_PTP,TOOL,BASE,EX_BASE,PTP_DAT,CP_DAT,OUT_SYNC,OUT_ASYNC,GROUP,PTP_PARAMS,CP_PARAMS,FRAMES
STRUC FDAT INT TOOL_NO,BASE_NO,IPO_M_T IPO_FRAME,CHAR POINT2[24],BOOL TQ_STATE
STRUC PDAT REAL VEL,ACC,APO_DIST
STRUC LDAT REAL VEL,ACC,APO_DIST,APO_FAC,ORI_TYPE ORI_TYP,CIRC_TYPE CIRC_TYP,REAL JERK_FAC
CONST FRAME $NULLFRAME={X 0.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0}
INT $ADVANCE=3
EXT BAS(BAS_COMMAND :IN,REAL :IN)
EXTFCT REAL ABS(REAL :IN)
EXTFCT REAL SQRT(REAL :IN)
EXTFCT REAL SIN(REAL :IN)
EXTFCT REAL COS(REAL :IN)
EXTFCT REAL TAN(REAL :IN)
EXTFCT REAL ACOS(REAL :IN)
EXTFCT REAL ATAN2(REAL :IN,REAL :IN)
EXTFCT FRAME INV_POS(FRAME :IN)
EXTFCT INT STRLEN(CHAR[] :IN)
EXTFCT INT STRDECLLEN(CHAR[] :IN)
EXTFCT BOOL STRCLEAR(CHAR[] :OUT)
EXTFCT BOOL STRCOPY(CHAR[] :OUT,CHAR[] :IN)
EXTFCT BOOL STRCOMP(CHAR[] :IN,CHAR[] :IN,CASE_SENSE_T :IN)
EXTFCT INT STRADD(CHAR[] :OUT,CHAR[] :IN)
EXTFCT INT STRFIND(INT :IN,CHAR[] :IN,CHAR[] :IN,CASE_SENSE_T :IN)
)";

namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

using Arguments = std::span<Value* const>;

using calib::krl::upper_case;

bool is_same(const Value& a, const Value& b, const Value& sense) {
  const bool exact = sense.i == 1;
  return exact ? a.text() == b.text() : upper_case(a.text()) == upper_case(b.text());
}

std::int32_t find(Arguments a) {
  const bool exact = a[3]->i == 1;
  const std::string in = exact ? a[1]->text() : upper_case(a[1]->text());
  const std::string what = exact ? a[2]->text() : upper_case(a[2]->text());
  if (a[0]->i < 1) return 0;
  const auto at = in.find(what, static_cast<std::size_t>(a[0]->i) - 1);
  return at == std::string::npos ? 0 : static_cast<std::int32_t>(at) + 1;
}

void bind_numbers(Program& program) {
  const auto real = [&program](const char* name, double (*function)(double, double)) {
    program.bind(name, [function, &type = program.type("REAL")](Arguments a) {
      const double result = function(a[0]->r, a.size() > 1 ? a[1]->r : 0.0);
      if (!std::isfinite(result)) throw RunError("argument outside the function's range");
      Value value(type);
      value.set(result);
      return value;
    });
  };
  real("ABS", [](double x, double) { return std::abs(x); });
  real("SQRT", [](double x, double) { return std::sqrt(x); });
  real("SIN", [](double x, double) { return std::sin(x * kDegree); });
  real("COS", [](double x, double) { return std::cos(x * kDegree); });
  real("TAN", [](double x, double) { return std::tan(x * kDegree); });
  real("ACOS", [](double x, double) { return std::acos(x) / kDegree; });
  real("ATAN2", [](double y, double x) { return std::atan2(y, x) / kDegree; });
  program.bind("INV_POS", [](Arguments a) { return inverse_frame(*a[0]); });
  program.bind("BAS", [](Arguments) { return Value(); });
}

}  // namespace

void bind_functions(Program& program) {
  bind_numbers(program);
  const auto whole = [&program](const char* name, const char* type,
                                std::function<std::int32_t(Arguments)> function) {
    program.bind(name, [function, &of = program.type(type)](Arguments a) {
      Value value(of);
      value.set_whole(function(a));
      return value;
    });
  };
  whole("STRLEN", "INT",
        [](Arguments a) { return static_cast<std::int32_t>(a[0]->text().size()); });
  whole("STRDECLLEN", "INT",
        [](Arguments a) { return static_cast<std::int32_t>(a[0]->parts.size()); });
  whole("STRCLEAR", "BOOL", [](Arguments a) { return a[0]->clear(), 1; });
  whole("STRCOPY", "BOOL", [](Arguments a) { return a[0]->set_text(a[1]->text()), 1; });
  whole("STRCOMP", "BOOL", [](Arguments a) { return is_same(*a[0], *a[1], *a[2]) ? 1 : 0; });
  whole("STRFIND", "INT", find);
  whole("STRADD", "INT", [](Arguments a) {
    const std::string text = a[0]->text() + a[1]->text();
    a[0]->set_text(text);
    return static_cast<std::int32_t>(text.size());
  });
}

}  // namespace cellcal::sim::krl
