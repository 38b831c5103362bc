#include "tests/daemon/certificate/origins.h"

#include <time.h>

#include <Eigen/Dense>
#include <cmath>
#include <cstring>
#include <map>
#include <numeric>
#include <optional>
#include <sstream>
#include <stdexcept>

#include "calib/check/pose_sheet.h"
#include "calib/estimate/predict.h"
#include "calib/files/calibration_json.h"
#include "calib/files/input_file.h"
#include "calib/files/toml.h"
#include "calib/model/linear.h"
#include "calib/verdict/change.h"

namespace cellcal::daemon::testing {

namespace {

using nlohmann::json;

constexpr double kMm = 1e3;

/// Doubles, little endian, in hexadecimal digits.
std::vector<double> doubles_of(const json& blob) {
  const std::string hex = blob.at("blob");
  std::vector<double> values(hex.size() / 16);
  for (std::size_t i = 0; i < values.size(); ++i) {
    unsigned char bytes[sizeof(double)];
    for (std::size_t k = 0; k < sizeof bytes; ++k)
      bytes[k] = static_cast<unsigned char>(std::stoul(hex.substr(16 * i + 2 * k, 2), nullptr, 16));
    std::memcpy(&values[i], bytes, sizeof bytes);
  }
  return values;
}

/// Seconds and the following are dropped: "2026-03-28T23:10:00.250Z".
std::string local(const std::string& utc) {
  struct tm fields {};
  if (::strptime(utc.c_str(), "%Y-%m-%dT%H:%M:%S", &fields) == nullptr)
    throw std::runtime_error("no time: " + utc);
  const time_t at = ::timegm(&fields);
  ::localtime_r(&at, &fields);
  char text[64];
  return {text, ::strftime(text, sizeof text, "%Y-%m-%d %H:%M:%S %Z (UTC%z)", &fields)};
}

std::variant<double, std::string> value_of(const json& value) {
  if (value.is_string()) return value.get<std::string>();
  if (value.is_number()) return value.get<double>();
  throw std::runtime_error("neither number nor text: " + value.dump());
}

double number(const std::variant<double, std::string>& value) { return std::get<double>(value); }

}  // namespace

nlohmann::ordered_json figure_of(const certificate::CertificateData& data, const std::string& id) {
  for (const auto& one : data.content.at("figures"))
    if (one.at("what") == calib::words(calib::Phrase(id))) return one;
  return nullptr;
}

Origins::Origins(const Archive& archive) : rows_(archive.at("rows.jsonl")) {
  std::istringstream lines(rows_);
  std::string line;
  std::getline(lines, line);  // header
  while (std::getline(lines, line)) {
    const json entry = json::parse(line);
    const json& columns = entry.at("columns");
    if (columns.is_null()) continue;
    if (entry.at("table") == "session") {
      session_ = columns;
      session_["id"] = std::to_string(entry.at("row").get<std::int64_t>());
    }
    if (entry.at("table") == "touch") touches_.push_back(columns);
    if (entry.at("table") == "change") changes_[entry.at("row")] = columns;
    if (entry.at("table") == "compared") {
      compared_ = json::parse(columns.at("calibration").get<std::string>());
      compared_words_ = columns.at("words");
    }
  }
  calibration_ = json::parse(session_.at("calibration").get<std::string>());
  cell_ = calib::toml_to_json(session_.at("cell_text").get<std::string>());
  robot_ = calib::toml_to_json(session_.at("robot_text").get<std::string>());
}

std::variant<double, std::string> Origins::touch(const std::string& path) const {
  const std::size_t slash = path.find('/');
  const std::size_t index = std::stoul(path.substr(0, slash));
  const std::string field = path.substr(slash + 1);
  const json& row = touches_.at(index);
  if (row.at("number") != index) throw std::runtime_error("touches are out of order");
  if (field == "number") return static_cast<double>(index + 1);
  if (field == "readings") return row.at("readings").get<double>();
  if (field == "speed_mm_s") return row.at("speed_m_s").get<double>() * kMm;
  if (field == "set") {
    for (const json& outlier : calibration_.at("outliers"))
      if (outlier.at("touch") == index) return "left out";
    for (const json& finding : calibration_.at("verdict").at("findings")) {
      if (finding.at("kind") != "gross_check_touches") continue;
      for (const json& part : finding.at("parts"))
        if (part.at("about").at("touch") == index) return "left out";
    }
    return row.at("held_out") == 1 ? "check" : "fit";
  }
  if (field.starts_with("joint_deg/"))
    return doubles_of(row.at("joint_rad")).at(std::stoul(field.substr(10))) * 180.0 / M_PI;
  return value_of(row.at(field));
}

std::variant<double, std::string> Origins::over_touches(const std::string& name) const {
  if (name == "count") return static_cast<double>(touches_.size());
  double lowest = 1e9, highest = -1e9;
  for (const json& row : touches_) {
    lowest = std::min(lowest, row.at("temperature_c").get<double>());
    highest = std::max(highest, row.at("temperature_c").get<double>());
  }
  return name == "lowest_c" ? lowest : highest;
}

/// The spheres and the radius offset are fitted by differences and QR, unlike in the certificate.
double Origins::found(const std::string& path) const {
  const calib::Calibration earlier = calib::calibration_from_json(compared_.dump(), "compared");
  const calib::Predictor predictor(earlier);
  struct Point {
    Eigen::Vector3d tip;
    Eigen::Index sphere;
    bool fit;
  };
  std::vector<Point> points;
  for (std::size_t i = 0; i < touches_.size(); ++i) {
    const std::string set = std::get<std::string>(touch(std::to_string(i) + "/set"));
    if (set == "left out") continue;
    const auto joints = doubles_of(touches_[i].at("joint_rad"));
    points.push_back({predictor.calibrated(joints).tcp.translation(),
                      static_cast<Eigen::Index>(
                          earlier.cell.target_index(touches_[i].at("target").get<std::string>())),
                      set == "fit"});
  }
  const auto targets = static_cast<Eigen::Index>(earlier.cell.targets.size());
  Eigen::VectorXd x(3 * targets + 1);
  for (Eigen::Index t = 0; t < targets; ++t)
    x.segment<3>(3 * t) = earlier.cell.targets[static_cast<std::size_t>(t)].centre_m;
  x[3 * targets] = 0.0;
  const auto residual = [&](const Point& one, const Eigen::VectorXd& at) {
    const double radius =
        earlier.cell.targets[static_cast<std::size_t>(one.sphere)].diameter_m / 2.0 +
        earlier.cell.tool.tip_radius_m;
    return (one.tip - at.segment<3>(3 * one.sphere)).norm() - radius - at[3 * targets];
  };
  for (int round = 0; round < 10; ++round) {
    Eigen::MatrixXd j =
        Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(points.size()) + 1, x.size());
    Eigen::VectorXd r = Eigen::VectorXd::Zero(j.rows());
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (!points[i].fit) continue;
      r[static_cast<Eigen::Index>(i)] = residual(points[i], x);
      for (Eigen::Index k = 0; k < x.size(); ++k) {
        Eigen::VectorXd moved = x;
        moved[k] += 1e-6;
        j(static_cast<Eigen::Index>(i), k) =
            (residual(points[i], moved) - r[static_cast<Eigen::Index>(i)]) / 1e-6;
      }
    }
    // A touch has a weight of a millimetre relative to the offset's prior.
    const double weight = 1e-3 / earlier.cell.radius_offset_sigma_m;
    j(j.rows() - 1, 3 * targets) = weight;
    r[j.rows() - 1] = weight * x[3 * targets];
    x -= j.colPivHouseholderQr().solve(r);
  }
  const bool fit = path.starts_with("fit/");
  double sum = 0.0, squares = 0.0, largest = 0.0;
  int count = 0;
  for (const Point& one : points) {
    if (one.fit != fit) continue;
    const double size = std::abs(residual(one, x)) * kMm;
    sum += size, squares += size * size, largest = std::max(largest, size), ++count;
  }
  if (path.ends_with("/mean_mm")) return sum / count;
  if (path.ends_with("/max_mm")) return largest;
  if (path.ends_with("/rms_mm")) return std::sqrt(squares / count);
  throw std::runtime_error(path);
}

/// Measured distances from predicted tips and the calibration's centres; the rest by calib.
std::variant<double, std::string> Origins::poses(const std::string& path) const {
  const calib::Calibration now = calib::calibration_from_json(calibration_.dump(), "now");
  const calib::Predictor predictor(now);
  std::vector<calib::Touch> touches;
  std::vector<bool> left_out;
  std::map<std::string, std::vector<double>> off_mm;
  for (std::size_t i = 0; i < touches_.size(); ++i) {
    const json& row = touches_[i];
    const std::string set = std::get<std::string>(touch(std::to_string(i) + "/set"));
    calib::Touch& one = touches.emplace_back();
    one.target = row.at("target");
    one.joint_rad = doubles_of(row.at("joint_rad"));
    one.speed_m_s = row.at("speed_m_s").get<double>();
    one.set = row.at("held_out") == 1 ? calib::TouchSet::kCheck : calib::TouchSet::kFit;
    left_out.push_back(set == "left out");
    if (set != "check") continue;
    for (const calib::TargetResult& target : now.targets)
      if (target.id == one.target)
        off_mm[one.target].push_back(
            kMm *
            std::abs(
                (predictor.calibrated(one.joint_rad).tcp.translation() - target.centre_m).norm() -
                target.effective_radius_m +
                one.speed_m_s * calib::correction_of(now, calib::latch_delay_parameter())));
  }
  const calib::PoseSheet sheet = calib::pose_sheet(now, touches, left_out);
  const std::size_t slash = path.find('/'), last = path.rfind('/');
  const std::size_t index = std::stoul(path.substr(slash + 1, last - slash - 1));
  const std::string field = path.substr(last + 1);
  if (path.starts_with("repeatability/")) {
    const calib::PoseRepeatability& row = sheet.repeatability.at(index);
    if (field == "target") return row.target;
    if (field == "first") return static_cast<double>(row.first + 1);
    if (field == "repeats") return static_cast<double>(row.repeats);
    if (field == "mean_mm") return row.mean_m * kMm;
    if (field == "sigma_mm") return row.sigma_m * kMm;
    if (field == "rp_mm") return row.rp_m * kMm;
    if (field == "predicted_mm") return row.predicted_m * kMm;
    throw std::runtime_error(path);
  }
  const calib::PoseAccuracy& row = sheet.accuracy.at(index);
  const std::vector<double>& measured = off_mm.at(row.target);
  const auto count = static_cast<double>(measured.size());
  if (field == "target") return row.target;
  if (field == "poses") return count;
  if (field == "mean_mm") return std::accumulate(measured.begin(), measured.end(), 0.0) / count;
  if (field == "max_mm") return *std::max_element(measured.begin(), measured.end());
  if (field == "predicted_mm") return row.predicted_m * kMm;
  throw std::runtime_error(path);
}

/// The base is aligned by a rigid motion, in Umeyama's closed form.
double Origins::scope(const std::string& name) const {
  const calib::Calibration now = calib::calibration_from_json(calibration_.dump(), "now");
  std::optional<calib::Predictor> earlier;
  if (!compared_.is_null())
    earlier.emplace(calib::calibration_from_json(compared_.dump(), "compared"));
  const calib::Predictor predictor(now);
  std::vector<calib::Touch> touches(touches_.size());
  for (std::size_t i = 0; i < touches.size(); ++i)
    touches[i].joint_rad = doubles_of(touches_[i].at("joint_rad"));
  const bool workspace = calibration_.at("verdict").at("scope") == "workspace";
  const auto poses = calib::poses_in_scope(now.cell, touches, workspace, calib::kScopePoses);
  const auto count = static_cast<Eigen::Index>(poses.size());
  if (name == "poses") return static_cast<double>(count);
  Eigen::Matrix3Xd before(3, count), after(3, count);
  Eigen::VectorXd u95(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const auto& q = poses[static_cast<std::size_t>(i)];
    const auto here = predictor.calibrated(q);
    after.col(i) = here.tcp.translation();
    before.col(i) = (earlier ? earlier->calibrated(q).tcp : predictor.nominal(q)).translation();
    u95[i] = here.u95_m;
  }
  const Eigen::Matrix4d base = calib::rigid_motion(before, after).matrix();
  const Eigen::VectorXd apart =
      (((base.topLeftCorner<3, 3>() * before).colwise() + base.topRightCorner<3, 1>()) - after)
          .colwise()
          .norm();
  if (name == "mean_mm") return apart.mean() * kMm;
  if (name == "max_mm") return apart.maxCoeff() * kMm;
  if (name == "u95_mean_mm") return u95.mean() * kMm;
  if (name == "u95_max_mm") return u95.maxCoeff() * kMm;
  throw std::runtime_error(name);
}

/// The unit stated next to a parameter.
std::string Origins::unit(const std::string& from) const {
  const std::string prefix = "calibration#";
  const std::size_t last = from.rfind('/');
  return calibration_.at(
      json::json_pointer(from.substr(prefix.size(), last - prefix.size()) + "/unit"));
}

std::variant<double, std::string> Origins::at(const std::string& from) const {
  const auto inside = [&](const std::string& function) -> std::optional<std::string> {
    if (!from.starts_with(function + "(") || !from.ends_with(")")) return std::nullopt;
    return from.substr(function.size() + 1, from.size() - function.size() - 2);
  };
  if (from.starts_with("k*")) return 2.0 * number(at(from.substr(2)));
  if (const auto of = inside("rms")) return number(at(*of)) / std::sqrt(8.0 / (3.0 * M_PI));
  for (const char* function : {"difference", "ratio", "hypot"})
    if (const auto of = inside(function)) {
      const std::size_t comma = of->find(',');
      const double a = number(at(of->substr(0, comma))), b = number(at(of->substr(comma + 1)));
      return *function == 'd' ? a - b : *function == 'r' ? a / b : std::hypot(a, b);
    }
  if (const auto of = inside("local")) return local(std::get<std::string>(at(*of)));
  if (const auto of = inside("unit")) return unit(*of);
  if (const auto of = inside("sha256"))
    return calib::sha256(*of == "rows" ? rows_ : std::get<std::string>(at(*of)));
  const auto options = [&] { return json::parse(session_.at("options").get<std::string>()); };
  if (from == "options#/emulated") return options().at("emulated") == true ? "emulated cell" : "";
  if (from == "number")
    return (options().at("emulated") == true ? "emulated-" : "") +
           session_.at("id").get<std::string>() + "-" +
           calib::sha256(session_.at("calibration").get<std::string>()).substr(0, 12);
  const std::size_t mark = from.find('#');
  const std::string source = from.substr(0, mark), path = from.substr(mark + 1);
  if (source == "session") return value_of(session_.at(path));
  if (source == "calibration") return value_of(calibration_.at(json::json_pointer(path)));
  if (source == "cell") return value_of(cell_.at(json::json_pointer(path)));
  if (source == "robot") return value_of(robot_.at(json::json_pointer(path)));
  if (from == "compared#words") return compared_words_;
  if (source == "touch") return touch(path);
  if (source == "touches") return over_touches(path);
  if (source == "change")
    return value_of(changes_.at(std::stol(path)).at(path.substr(path.find('/') + 1)));
  if (source == "found") return found(path);
  if (source == "scope") return scope(path);
  if (source == "poses") return poses(path);
  // Values stated by the issuer, and constants of the method, defined by the test.
  static const std::map<std::string, std::string> kStated{{"issue#at", kIssue.utc},
                                                          {"issue#by", kIssue.by},
                                                          {"issue#software", kIssue.software},
                                                          {"method#k", "2"},
                                                          {"method#percent", "95"},
                                                          {"method#guidance", "ILAC-G8:09/2019"},
                                                          {"method#standard", "14253-1"},
                                                          {"method#guard_band", "0"},
                                                          {"method#sum", "256"},
                                                          {"method#performance", "9283"},
                                                          {"method#cycles", "30"}};
  return kStated.at(from);
}

}  // namespace cellcal::daemon::testing
