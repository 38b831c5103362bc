// A struct and a JSON object by one table: values are read back, and errors name the field.

#include "calib/files/json_fields.h"

#include <gtest/gtest.h>

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace cellcal::calib::fields {
namespace {

enum class Shape { kRound, kFlat };

struct Inner {
  double length_m = 0.0;
  int count = 0;
  bool operator==(const Inner&) const = default;
};

struct Outer {
  std::string name;
  Shape shape = Shape::kRound;
  double radius_m = 0.0, height_m = 0.0, sigma_m = 0.0;
  bool is_open = false;
  Eigen::Vector3d place_m = Eigen::Vector3d::Zero();
  Inner inner, own;
  std::vector<Inner> several;
};

Table<Inner> inner_fields() {
  return {field("length_mm", &Inner::length_m, number(1e3)),
          optional(field("count", &Inner::count, whole<int>()))};
}

Table<Outer> outer_fields() {
  const auto round = [](const Outer& o) { return o.shape == Shape::kRound; };
  const auto flat = [](const Outer& o) { return o.shape == Shape::kFlat; };
  const auto measured = [](const Outer& o) { return o.sigma_m > 0.0; };
  return joined<Outer>(
      {field("name", &Outer::name, text()),
       field("shape", &Outer::shape,
             word<Shape>({{Shape::kRound, "round"}, {Shape::kFlat, "flat"}})),
       only_of<Outer>(round, field("radius_mm", &Outer::radius_m, not_negative(1e3))),
       only_of<Outer>(flat, field("height_mm", &Outer::height_m, number(1e3))),
       where<Outer>(measured, field("sigma_mm", &Outer::sigma_m, not_negative(1e3))),
       field("open", &Outer::is_open, flag()), field("place_mm", &Outer::place_m, vector(1e3)),
       field("inner", &Outer::inner, object(inner_fields())),
       field("several", &Outer::several, list(object(inner_fields()))),
       group<Outer>("shown",
                    {for_readers<Outer>("twice", [](const Outer& o) { return o.name + o.name; }),
                     field("again", &Outer::name, text())})},
      of_member(&Outer::own, inner_fields()));
}

Outer some() {
  Outer o;
  o.name = "bar";
  o.radius_m = 0.03125;
  o.is_open = true;
  o.place_m = {1.0, -2.0, 0.5};
  o.inner = {0.25, 3};
  o.own = {0.125, 4};
  o.several = {{0.5, 1}, {1.0, 2}};
  return o;
}

Outer read(const nlohmann::json& document) {
  Outer o;
  from_json(outer_fields(), JsonReader(document, "f.json"), o);
  return o;
}

nlohmann::json written() { return nlohmann::json::parse(to_json(outer_fields(), some()).dump()); }

std::string refusal(const std::function<void(nlohmann::json&)>& harm) {
  nlohmann::json document = written();
  harm(document);
  try {
    (void)read(document);
  } catch (const FileError& error) {
    EXPECT_EQ(error.file, "f.json") << error.what();
    return error.what();
  }
  return "was read";
}

TEST(JsonFields, StandInTheFileInTheOrderOfTheirRows) {
  EXPECT_EQ(to_json(outer_fields(), some()).dump(),
            R"({"name":"bar","shape":"round","radius_mm":31.25,"open":true,)"
            R"("place_mm":[1000.0,-2000.0,500.0],"inner":{"length_mm":250.0,"count":3},)"
            R"("several":[{"length_mm":500.0,"count":1},{"length_mm":1000.0,"count":2}],)"
            R"("shown":{"twice":"barbar","again":"bar"},"length_mm":125.0,"count":4})");
}

TEST(JsonFields, ComeBackAsTheyWereWritten) {
  const Outer back = read(written());
  EXPECT_EQ(back.name, "bar");
  EXPECT_EQ(back.shape, Shape::kRound);
  EXPECT_EQ(back.radius_m, 0.03125);
  EXPECT_TRUE(back.is_open);
  EXPECT_EQ(back.place_m, some().place_m);
  EXPECT_EQ(back.inner, some().inner);
  EXPECT_EQ(back.own, some().own);
  EXPECT_EQ(back.several, some().several);
}

TEST(JsonFields, OfSomeValuesOnlyAreWantedOfThoseAlone) {
  Outer flat = some();
  flat.shape = Shape::kFlat;
  flat.height_m = -0.002;
  const auto document = nlohmann::json::parse(to_json(outer_fields(), flat).dump());
  EXPECT_FALSE(document.contains("radius_mm"));
  EXPECT_DOUBLE_EQ(read(document).height_m, -0.002);
  EXPECT_EQ(refusal([](auto& d) { d["shape"] = "flat"; }), "f.json: key \"height_mm\" is missing");
}

TEST(JsonFields, ThatMayLackLeaveTheirDefault) {
  EXPECT_FALSE(written().contains("sigma_mm")) << "there is nothing to say";
  EXPECT_EQ(read(written()).sigma_m, 0.0);
  nlohmann::json document = written();
  document["sigma_mm"] = 2.0;
  document["inner"].erase("count");
  EXPECT_DOUBLE_EQ(read(document).sigma_m, 0.002);
  EXPECT_EQ(read(document).inner.count, 0);
}

TEST(JsonFields, BesideAnotherAreWantedWhereThatOneStands) {
  const Table<Inner> both = {beside("length_mm", field("count", &Inner::count, whole<int>())),
                             optional(field("length_mm", &Inner::length_m, number()))};
  Inner inner;
  const nlohmann::json neither = nlohmann::json::object(), one = {{"length_mm", 1.0}};
  EXPECT_NO_THROW(from_json(both, JsonReader(neither, "f"), inner));
  EXPECT_THROW(from_json(both, JsonReader(one, "f"), inner), FileError);
}

TEST(JsonFields, ThatAreForReadersAreNotReadBack) {
  nlohmann::json document = written();
  document["shown"]["twice"] = 7;
  EXPECT_NO_THROW((void)read(document));
  document["shown"].erase("twice");
  EXPECT_NO_THROW((void)read(document));
}

TEST(JsonFields, ThatAreWrongAreNamedWithTheirPlace) {
  EXPECT_EQ(refusal([](auto& d) { d.erase("name"); }), "f.json: key \"name\" is missing");
  EXPECT_EQ(refusal([](auto& d) { d["shape"] = "cone"; }),
            "f.json.shape: must be \"round\" or \"flat\"");
  EXPECT_EQ(refusal([](auto& d) { d["radius_mm"] = -1; }),
            "f.json.radius_mm: must not be negative");
  EXPECT_EQ(refusal([](auto& d) { d["open"] = 1; }), "f.json.open: must be true or false");
  EXPECT_EQ(refusal([](auto& d) { d["place_mm"].erase(0); }),
            "f.json.place_mm: must hold three numbers");
  EXPECT_EQ(refusal([](auto& d) { d["inner"] = 3; }), "f.json.inner: key \"length_mm\" is missing");
  EXPECT_EQ(refusal([](auto& d) { d["several"][1]["count"] = 1.5; }),
            "f.json.several[1].count: must be a whole number, 0 to 1e9");
  EXPECT_EQ(refusal([](auto& d) { d["shown"]["again"] = 1; }),
            "f.json.shown.again: must be a string");
  EXPECT_EQ(refusal([](auto& d) { d["length_mm"] = nullptr; }),
            "f.json.length_mm: must be a number");
}

}  // namespace
}  // namespace cellcal::calib::fields
