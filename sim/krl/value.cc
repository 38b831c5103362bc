#include "sim/krl/value.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "calib/model/units.h"

namespace cellcal::sim::krl {

namespace {

constexpr const char* kFrame[] = {"X", "Y", "Z", "A", "B", "C"};

Eigen::Isometry3d pose_of(const Value& value) {
  calib::FrameMmDeg frame;
  for (std::size_t i = 0; i < 6; ++i) {
    if (!value.parts[i].given)
      throw RunError(value.type->name + ": component " + kFrame[i] + " has no value");
    (i < 3 ? frame.xyz_mm[i] : frame.abc_deg[i - 3]) = value.parts[i].r;
  }
  return calib::to_isometry(frame);
}

void put(Value& value, const Eigen::Isometry3d& pose) {
  const calib::FrameMmDeg frame = calib::to_frame(pose);
  for (std::size_t i = 0; i < 6; ++i)
    value.parts[i].set(i < 3 ? frame.xyz_mm[i] : frame.abc_deg[i - 3]);
}

}  // namespace

int Type::index_of(std::string_view word) const {
  const auto at = std::find(names.begin(), names.end(), word);
  return at == names.end() ? -1 : static_cast<int>(at - names.begin());
}

double Type::scalars() const {
  double count = kind == Kind::kStruct || kind == Kind::kArray ? 0.0 : 1.0;
  for (const Type* part : parts) count += part->scalars();
  for (const int extent : extents) count *= extent;
  return count;
}

bool is_frame(const Type& type) {
  return type.kind == Type::Kind::kStruct && type.names.size() >= 6 &&
         std::equal(std::begin(kFrame), std::end(kFrame), type.names.begin());
}

bool assignable(const Type& to, const Type& from) {
  if (&to == &from || (to.number() && from.number())) return true;
  if (to.kind != Type::Kind::kArray || from.kind != Type::Kind::kArray) return false;
  return to.parts[0] == from.parts[0] && to.extents.size() == from.extents.size();
}

Value::Value(const Type& of) : type(&of) {
  if (of.kind == Type::Kind::kStruct) {
    parts.reserve(of.parts.size());
    for (const Type* part : of.parts) parts.emplace_back(*part);
  } else if (of.kind == Type::Kind::kArray) {
    std::size_t count = 1;
    for (const int extent : of.extents) count *= static_cast<std::size_t>(extent);
    parts.assign(count, Value(*of.parts[0]));
  }
}

Value& Value::part(std::string_view name) {
  return const_cast<Value&>(static_cast<const Value*>(this)->part(name));
}
const Value& Value::part(std::string_view name) const {
  const int at = type->index_of(name);
  if (at < 0) throw std::logic_error(type->name + " has no component " + std::string(name));
  return parts[static_cast<std::size_t>(at)];
}

bool Value::any() const {
  return given || std::any_of(parts.begin(), parts.end(), [](const Value& v) { return v.any(); });
}

double Value::number() const {
  return type->kind == Type::Kind::kReal ? static_cast<double>(r) : static_cast<double>(i);
}

std::string Value::text() const {
  std::string result;
  for (const Value& one : parts) {
    if (!one.given) break;
    result += static_cast<char>(one.i);
  }
  return result;
}

void Value::set(double number) {
  if (type->kind == Type::Kind::kReal) {
    r = static_cast<float>(number);
    if (!std::isfinite(r)) throw RunError("a REAL beyond its range");
  } else {
    if (!(std::abs(number) < 2147483647.5)) throw RunError("an INT beyond its range");
    i = static_cast<std::int32_t>(std::lround(number));
  }
  given = true;
}

void Value::set_whole(std::int32_t whole) {
  i = whole;
  given = true;
}

void Value::set_text(std::string_view text) {
  if (text.size() > parts.size())
    throw RunError("\"" + std::string(text) + "\" is longer than " + std::to_string(parts.size()) +
                   " CHAR");
  for (std::size_t at = 0; at < parts.size(); ++at) {
    parts[at].given = at < text.size();
    parts[at].i = parts[at].given ? static_cast<unsigned char>(text[at]) : 0;
  }
}

void Value::clear() {
  given = false;
  for (Value& one : parts) one.clear();
}

void assign(Value& to, const Value& from) {
  if (to.type->number()) return to.set(from.number());
  if (to.type->text()) return to.set_text(from.text());
  if (to.parts.size() != from.parts.size()) throw RunError("arrays of different size");
  for (std::size_t at = 0; at < to.parts.size(); ++at) to.parts[at] = from.parts[at];
  to.i = from.i;
  to.given = from.given;
}

Value composed(const Value& a, const Value& b) {
  Value result = b;
  put(result, pose_of(a) * pose_of(b));
  return result;
}

Value inverse_frame(const Value& frame) {
  Value result = frame;
  put(result, pose_of(frame).inverse());
  return result;
}

}  // namespace cellcal::sim::krl
