#include "calib/files/parts/outlier_json.h"

#include "calib/model/target_kind.h"
#include "calib/model/units.h"

namespace cellcal::calib {

nlohmann::ordered_json outlier_to_json(const Outlier& o) {
  nlohmann::ordered_json out = {{"touch", o.touch},
                                {"residual_mm", o.residual_m * kMmPerM},
                                {"reason", words(o)},
                                {"leverage", o.leverage},
                                {"kind", to_string(o.kind)}};
  if (o.kind == OutlierKind::kRecorded) return out;
  out["target"] = o.target;
  out["target_kind"] = to_string(o.target_kind);
  out["sigmas"] = o.sigmas;
  if (o.kind == OutlierKind::kOnAnotherTarget) out["lies_on"] = o.lies_on;
  return out;
}

Outlier outlier_from_json(const JsonReader& item) {
  Outlier o{item.at("touch").whole(), item.at("residual_mm").number() / kMmPerM};
  if (item.has("leverage")) o.leverage = item.at("leverage").not_negative();
  const auto kind = item.has("kind") ? outlier_kind(item.at("kind").text()) : std::nullopt;
  if (kind.value_or(OutlierKind::kRecorded) == OutlierKind::kRecorded) {
    o.text = item.at("reason").text();
    return o;
  }
  o.kind = *kind;
  o.target = item.at("target").text();
  const auto known = target_kind(item.at("target_kind").text());
  if (!known) item.at("target_kind").fail("is no kind of target");
  o.target_kind = *known;
  o.sigmas = item.at("sigmas").not_negative();
  if (o.kind == OutlierKind::kOnAnotherTarget) o.lies_on = item.at("lies_on").text();
  return o;
}

}  // namespace cellcal::calib
