#include "calib/files/json_fields.h"

namespace cellcal::calib::fields {

Value<double> number(double per) {
  return {[per](const double& v) { return v * per; },
          [per](const JsonReader& r) { return r.number() / per; }};
}

Value<double> not_negative(double per) {
  return {[per](const double& v) { return v * per; },
          [per](const JsonReader& r) { return r.not_negative() / per; }};
}

Value<std::string> text() {
  return {[](const std::string& v) { return v; }, [](const JsonReader& r) { return r.text(); }};
}

Value<bool> flag() {
  return {[](const bool& v) { return v; }, [](const JsonReader& r) { return r.flag(); }};
}

Value<Eigen::Vector3d> vector(double per) {
  return {[per](const Eigen::Vector3d& v) -> Json {
            return {v.x() * per, v.y() * per, v.z() * per};
          },
          [per](const JsonReader& r) -> Eigen::Vector3d {
            const auto items = r.items();
            if (items.size() != 3) r.fail("must hold three numbers");
            return Eigen::Vector3d(items[0].number(), items[1].number(), items[2].number()) / per;
          }};
}

}  // namespace cellcal::calib::fields
