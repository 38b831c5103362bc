#include <cmath>
#include <numbers>

#include "sim/krl/program.h"

namespace cellcal::sim::krl {

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
