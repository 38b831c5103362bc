#include "calib/result/outlier.h"

#include <cmath>

#include "calib/model/units.h"
#include "calib/result/finding_phrase.h"

namespace cellcal::calib {

namespace {

/// Sentence with a hint on how the touch may have been made; null: none.
const char* hint(TargetKind kind, double residual_m) {
  if (!std::isfinite(residual_m)) return nullptr;
  const bool outside = residual_m > 0.0;
  switch (kind) {
    case TargetKind::kSphere:
    case TargetKind::kPlane: return outside ? "say.outlier.early" : "say.outlier.late";
    case TargetKind::kWire: return outside ? "say.outlier.wire_short" : "say.outlier.wire_long";
    case TargetKind::kPoint: return "say.outlier.seat";
    case TargetKind::kTracker: return "say.outlier.sight";
  }
  return nullptr;
}

/// "+0.123 mm off S1 (4 sigma)"; a distance of three components has no sign.
Phrase off_phrase(const Outlier& o) {
  const bool sideless =
      o.target_kind == TargetKind::kPoint || o.target_kind == TargetKind::kTracker;
  const double mm = (sideless ? std::abs(o.residual_m) : o.residual_m) * kMmPerM;
  const char* const id = !std::isfinite(mm) ? "say.outlier.off.unknown"
                         : sideless         ? "say.outlier.off.by"
                                            : "say.outlier.off";
  const Phrase off(id, {{"mm", mm}, {"target", o.target}});
  if (!std::isfinite(o.sigmas)) return off;
  return {"say.outlier.sigmas", {{"off", off}, {"sigmas", o.sigmas}}};
}

}  // namespace

Phrase phrase(const Outlier& o) {
  if (o.kind == OutlierKind::kRecorded) return o.text;
  const Phrase off = off_phrase(o);
  if (o.kind == OutlierKind::kOnAnotherTarget)
    return {"say.outlier.on_another", {{"off", off}, {"on", o.lies_on}}};
  const char* const id = hint(o.target_kind, o.residual_m);
  const Phrase text = id == nullptr ? off : Phrase(id, {{"off", off}});
  if (o.kind != OutlierKind::kHoldsItself || !std::isfinite(o.leverage)) return text;
  return joined("say.join.sentences", text,
                {o.target_kind == TargetKind::kTracker ? "say.outlier.leverage.measure"
                                                       : "say.outlier.leverage",
                 {{"percent", 100.0 * o.leverage}}});
}

std::string words(const Outlier& o) { return words(phrase(o)); }

}  // namespace cellcal::calib
