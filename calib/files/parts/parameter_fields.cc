#include "calib/files/parts/parameter_fields.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <set>
#include <string>
#include <utility>

#include "calib/files/parts/unidentifiable_json.h"
#include "calib/linear/cholesky.h"
#include "calib/model/units.h"
#include "calib/result/nominal_value.h"
#include "calib/syntax/shown.h"

namespace cellcal::calib {

namespace {

using fields::Field, fields::Json, fields::Table, fields::field, fields::from_json, fields::to_json,
    fields::word;

constexpr std::array<std::pair<const char*, double>, 7> kUnits{{{"mm", kMmPerM},
                                                                {"ms", kMsPerS},
                                                                {"deg", kDegPerRad},
                                                                {"arcsec", 3600.0 * kDegPerRad},
                                                                {"1/(N m^2)", 1.0},
                                                                {"rad/(N m)", 1.0},
                                                                {"kg m rad/(N m)", 1.0}}};

double per_si(const JsonReader& r) {
  const std::string unit = r.text();
  for (const auto& [name, factor] : kUnits)
    if (unit == name) return factor;
  r.fail("\"" + shown(unit) + "\" is not known");
}

/// Unit by unit: the rows behind "unit" are in that one.
Table<ParameterResult> parameter_fields(const Cell& cell) {
  using P = ParameterResult;
  const auto name = [&cell](const P& p) -> Json { return parameter_name(cell, p.key); };
  const auto read_name = [&cell](const JsonReader& r, P& p) {
    p.key = parameter_from_json(cell, r);
  };
  const auto read_unit = [](const JsonReader& r, P& p) {
    p.to_unit = per_si(r);
    p.unit = r.text();
  };
  const auto nominal = [&cell](const P& p) -> Json {
    return (stated_value(cell, p.key) + p.nominal) * p.to_unit;
  };
  const auto read_nominal = [&cell](const JsonReader& r, P& p) {
    const double value = r.number() / p.to_unit;
    if (!is_geometric(p.key.kind) && p.key.kind != ParameterKind::kTcp) {
      p.nominal = value;
      return;
    }
    // It is in the cell already; earlier versions wrote 0 here.
    const double stated = stated_value(cell, p.key);
    constexpr double kRounding = 1e-9;
    if (value != 0.0 && !(std::abs(value - stated) <= kRounding * std::abs(stated)))
      r.fail(
          fmt::format("is {:g} {}, and {:g} {} in robot or cell: one was altered. Take the file "
                      "from its session again: 'cellcal export ID DIR'",
                      r.number(), p.unit, stated * p.to_unit, p.unit));
  };
  const auto read_correction = [](const JsonReader& r, P& p) {
    constexpr double kMostInUnit = 1e6;  // a kilometre, many turns
    if (!(std::abs(r.number()) <= kMostInUnit)) r.fail("is out of range, -1e6 to 1e6");
    p.correction = r.number() / p.to_unit;
  };
  return {
      {"name", name, read_name},
      {"unit", [](const P& p) -> Json { return p.unit; }, read_unit},
      {"nominal", nominal, read_nominal},
      {"correction", [](const P& p) -> Json { return p.correction * p.to_unit; }, read_correction},
      {"sigma", [](const P& p) -> Json { return p.sigma * p.to_unit; },
       [](const JsonReader& r, P& p) { p.sigma = r.not_negative() / p.to_unit; }},
      field("decided_by", &P::decided_by,
            word<DecidedBy>({{DecidedBy::kData, to_string(DecidedBy::kData)},
                             {DecidedBy::kPrior, to_string(DecidedBy::kPrior)},
                             {DecidedBy::kFrame, to_string(DecidedBy::kFrame)}}))};
}

void read_parameters(const JsonReader& reader, Calibration& c) {
  const auto table = parameter_fields(c.cell);
  std::set<ParameterKey> keys;
  for (const JsonReader& item : reader.items()) {
    from_json(table, item, c.parameters.emplace_back());
    const JsonReader name = item.at("name");
    if (!keys.insert(c.parameters.back().key).second)
      name.fail("\"" + shown(name.text()) + "\" stands twice");
  }
}

/// Rows are in the parameters' units; columns as well, or are single steps.
enum class Columns { kParameters, kSteps };

double column_unit(const Calibration& c, Columns columns, std::size_t k) {
  return columns == Columns::kParameters ? c.parameters[k].to_unit : 1.0;
}

Json matrix_json(const Calibration& c, const Eigen::MatrixXd& m, Columns columns) {
  Json rows = Json::array();
  for (Eigen::Index i = 0; i < m.rows(); ++i) {
    Json row = Json::array();
    for (Eigen::Index k = 0; k < m.cols(); ++k)
      row.push_back(m(i, k) * c.parameters[static_cast<std::size_t>(i)].to_unit *
                    column_unit(c, columns, static_cast<std::size_t>(k)));
    rows.push_back(std::move(row));
  }
  return rows;
}

Eigen::MatrixXd read_matrix(const JsonReader& reader, const Calibration& c, Columns columns) {
  const auto n = static_cast<Eigen::Index>(c.parameters.size());
  const auto rows = reader.items();
  // An empty covariance would read as perfect knowledge.
  if (static_cast<Eigen::Index>(rows.size()) != n) reader.fail("must have one row per parameter");
  const Eigen::Index wanted = columns == Columns::kParameters ? n
                              : rows.empty()                  ? 0
                                             : static_cast<Eigen::Index>(rows[0].items().size());
  // All rows are looked at before there is a matrix: what is short in the file is no reason for a large one.
  for (const JsonReader& row : rows)
    if (static_cast<Eigen::Index>(row.items().size()) != wanted)
      row.fail("has " + std::to_string(row.items().size()) + " entries, " + std::to_string(wanted) +
               " are needed");
  Eigen::MatrixXd m = Eigen::MatrixXd::Zero(n, wanted);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const auto items = rows[i].items();
    for (std::size_t k = 0; k < items.size(); ++k)
      m(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k)) =
          items[k].number() / c.parameters[i].to_unit / column_unit(c, columns, k);
  }
  return m;
}

/// Whether the bounds that come of it will be real numbers.
bool is_covariance(const Eigen::MatrixXd& m) {
  if (m.size() == 0) return true;     // of no parameters
  constexpr double kRounding = 1e-9;  // of correlations
  const Eigen::VectorXd sigma = m.diagonal().cwiseMax(0.0).cwiseSqrt();
  const Eigen::VectorXd scale = (sigma.array() > 0.0).select(sigma, 1.0).cwiseInverse();
  Eigen::MatrixXd correlation = scale.asDiagonal() * m * scale.asDiagonal();
  if (!correlation.allFinite() || m.diagonal().minCoeff() < 0.0) return false;
  if ((correlation - correlation.transpose()).cwiseAbs().maxCoeff() > kRounding) return false;
  correlation.diagonal().array() += kRounding;
  return Cholesky(correlation).positive();
}

void read_covariance(const JsonReader& reader, Calibration& c) {
  c.covariance = read_matrix(reader, c, Columns::kParameters);
  if (!is_covariance(c.covariance))
    reader.fail("is not a covariance (symmetric, no direction with a variance below 0)");
}

}  // namespace

Field<Calibration> parameters_field() {
  return {"parameters",
          [](const Calibration& c) {
            const auto table = parameter_fields(c.cell);
            Json out = Json::array();
            for (const ParameterResult& p : c.parameters) out.push_back(to_json(table, p));
            return out;
          },
          read_parameters};
}

Field<Calibration> covariance_field() {
  return {"covariance",
          [](const Calibration& c) { return matrix_json(c, c.covariance, Columns::kParameters); },
          read_covariance};
}

Field<Calibration> frame_basis_field() {
  return {"frame_basis",
          [](const Calibration& c) { return matrix_json(c, c.frame_basis, Columns::kSteps); },
          [](const JsonReader& r, Calibration& c) {
            c.frame_basis = read_matrix(r, c, Columns::kSteps);
          }};
}

}  // namespace cellcal::calib
