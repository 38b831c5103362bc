#include "calib/files/parts/update_fields.h"

#include "calib/model/units.h"
#include "calib/words/check_words.h"

namespace cellcal::calib {

namespace {

using fields::Field, fields::Json, fields::Table, fields::Value, fields::field, fields::for_readers,
    fields::list, fields::not_negative, fields::number, fields::object, fields::only_of,
    fields::text, fields::vector, fields::where, fields::whole;

constexpr double kPerMillion = 1e6;

/// A kind by its name; what is not known is refused.
template <class E, class Name, class Named>
Value<E> named(Name name, Named named) {
  return {[=](const E& value) -> Json { return name(value); },
          [=](const JsonReader& r) {
            const auto found = named(r.text());
            if (!found) r.fail("is not known");
            return *found;
          }};
}

bool is_shift(const Explanation& one) {
  return one.kind == ChangeKind::kTool || one.kind == ChangeKind::kSphere;
}

/// One row of the kind whose amount is in that unit.
Field<Explanation> amount(const char* key, ChangeKind kind, double per) {
  return only_of<Explanation>([=](const Explanation& one) { return one.kind == kind; },
                              field(key, &Explanation::amount, number(per)));
}

Field<Explanation> sigma(const char* key, bool (*those)(const Explanation&), double per) {
  return only_of<Explanation>(those, field(key, &Explanation::sigma, not_negative(per)));
}

Table<Explanation> explanation_fields() {
  using E = Explanation;
  const auto of_touch = [](const E& one) { return one.kind == ChangeKind::kTouch; };
  const auto kind = named<ChangeKind>([](ChangeKind one) { return to_string(one); }, change_kind);
  return {
      field("kind", &E::kind, kind),
      field("name", &E::name, text()),
      field("probability", &E::probability, not_negative()),
      field("log_likelihood", &E::log_likelihood, number()),
      only_of<E>(of_touch, field("touch", &E::touch, whole<std::size_t>())),
      only_of<E>(is_shift, field("shift_mm", &E::shift_m, vector(kMmPerM))),
      amount("angle_deg", ChangeKind::kJoint, kDegPerRad),
      amount("growth_ppm", ChangeKind::kGrowth, kPerMillion),
      amount("off_mm", ChangeKind::kTouch, kMmPerM),
      sigma(
          "sigma_mm", [](const E& one) { return is_shift(one) || one.kind == ChangeKind::kTouch; },
          kMmPerM),
      sigma(
          "sigma_deg", [](const E& one) { return one.kind == ChangeKind::kJoint; }, kDegPerRad),
      sigma(
          "sigma_ppm", [](const E& one) { return one.kind == ChangeKind::kGrowth; }, kPerMillion),
      for_readers<E>("words", [](const E& one) -> Json { return words(one); })};
}

Field<UpdateOrigin> second_field() {
  using U = UpdateOrigin;
  const auto one = object(explanation_fields());
  return where<U>([](const U& u) { return u.second.has_value(); },
                  {"second", [=](const U& u) { return one.to(*u.second); },
                   [=](const JsonReader& r, U& u) { u.second = one.from(r); }});
}

}  // namespace

Table<UpdateOrigin> update_fields() {
  using U = UpdateOrigin;
  const auto outcome =
      named<UpdateOutcome>([](UpdateOutcome one) { return to_string(one); }, update_outcome);
  return {field("outcome", &U::outcome, outcome),
          field("stands_on", &U::stands_on, text()),
          field("months", &U::months, not_negative()),
          field("touches", &U::touches, whole<std::size_t>()),
          field("set_aside", &U::set_aside, list(whole<std::size_t>())),
          field("not_found", &U::not_found, list(text())),
          field("explanations", &U::explanations, list(object(explanation_fields()))),
          field("chi2", &U::chi2, not_negative()),
          field("degrees_of_freedom", &U::degrees_of_freedom, not_negative()),
          field("by_chance", &U::by_chance, not_negative()),
          field("log_odds_second", &U::log_odds_second, number()),
          second_field(),
          field("m3_before_mm", &U::before_m, not_negative(kMmPerM)),
          field("m3_reached_mm", &U::reached_m, not_negative(kMmPerM))};
}

}  // namespace cellcal::calib
