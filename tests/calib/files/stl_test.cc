// STL files, valid and hostile.

#include <gtest/gtest.h>

#include <bit>
#include <cstdint>
#include <limits>

#include "calib/files/cell_file.h"
#include "tests/calib/files/documents.h"

namespace cellcal::calib {
namespace {

using testing::expect_words;
using testing::refusal;

std::string ascii(const std::string& corners) {
  return "solid made by hand\nfacet normal 0 0 1\n outer loop\n" + corners +
         " endloop\nendfacet\nendsolid made by hand\n";
}
const std::string kCorners = "  vertex 0 0 0\n  vertex +1e2 0 0\n  vertex 0 1.5E+01 -2.5\n";

void put(std::string& bytes, std::uint32_t value) {
  for (int k = 0; k < 4; ++k) bytes += static_cast<char>((value >> (8 * k)) & 0xff);
}

/// `triangles` of nine numbers each, in millimetres.
std::string binary(const std::vector<std::array<float, 9>>& triangles, std::string header = "x") {
  header.resize(80, ' ');
  std::string bytes = header;
  put(bytes, static_cast<std::uint32_t>(triangles.size()));
  for (const auto& triangle : triangles) {
    for (int k = 0; k < 3; ++k) put(bytes, 0x7fc00000u);  // a normal that is not a number
    for (const float value : triangle) put(bytes, std::bit_cast<std::uint32_t>(value));
    bytes += std::string(2, '\0');
  }
  return bytes;
}
constexpr std::array<float, 9> kTriangle = {0, 0, 0, 100, 0, 0, 0, 15, -2.5f};

std::string stl_refusal(const std::string& bytes) {
  return refusal([&] { (void)parse_stl(bytes, "f.stl"); }, "f.stl");
}

void expect_the_triangle(const Mesh& mesh) {
  ASSERT_EQ(mesh.triangles.size(), 1u);
  EXPECT_EQ(mesh.triangles[0], (std::array{0, 1, 2}));
  EXPECT_LT((mesh.vertices_m[1] - Eigen::Vector3d(0.1, 0, 0)).norm(), 1e-15);
  EXPECT_LT((mesh.vertices_m[2] - Eigen::Vector3d(0, 0.015, -0.0025)).norm(), 1e-15);
}

TEST(Stl, ReadsAsciiAndBinaryAlike) {
  expect_the_triangle(parse_stl(ascii(kCorners), "f.stl"));
  expect_the_triangle(parse_stl(binary({kTriangle}), "f.stl"));
}

TEST(Stl, ReadsBinaryThatBeginsWithTheWordSolid) {
  expect_the_triangle(parse_stl(binary({kTriangle}, "solid from a CAD system"), "f.stl"));
}

TEST(Stl, ReadsSeveralSolidsWindowsLinesAndCapitals) {
  std::string text = ascii(kCorners) + ascii(kCorners), shouted;
  for (const char c : text)
    if (c == '\n')
      shouted += "\r\n";
    else
      shouted += static_cast<char>(c >= 'a' && c <= 'z' && c != 'e' ? c - 32 : c == 'e' ? 'E' : c);
  EXPECT_EQ(parse_stl(shouted, "f.stl").triangles.size(), 2u);
}

TEST(Stl, LeavesOutTrianglesWithoutAnArea) {
  constexpr std::array<float, 9> kNeedle = {0, 0, 0, 1, 1, 1, 2, 2, 2};
  EXPECT_EQ(parse_stl(binary({kNeedle, kTriangle}), "f.stl").triangles.size(), 1u);
  expect_words(stl_refusal(binary({kNeedle})), {"f.stl", "no triangle"});
}

TEST(Stl, NamesTheLineThatItDoesNotUnderstand) {
  expect_words(stl_refusal(ascii("  vertex 0 0 0\n  vertex 1 0 zero\n")), {"f.stl:5:", "zero"});
  expect_words(stl_refusal(ascii("  vertex 0 0 0\n  vertex 1 0 nan\n")), {"f.stl:5:", "100 m"});
  expect_words(stl_refusal(ascii("  vertex 0 0 0\n  vertex 1e9 0 0\n")), {"f.stl:5:", "100 m"});
  expect_words(stl_refusal(ascii("  vertex 0 0 0\n  vertex 1 0\n")), {"f.stl:6:", "endloop"});
  expect_words(stl_refusal(ascii(kCorners + "  vertex 1 1 1\n")), {"f.stl:7:", "endloop"});
  expect_words(stl_refusal("solid\n"), {"f.stl:2:", "facet"});
  const std::string whole = ascii(kCorners);
  for (std::size_t length = 5; length + 25 < whole.size(); ++length)
    expect_words(stl_refusal(whole.substr(0, length)), {"f.stl:"});
}

TEST(Stl, NamesTheByteThatItDoesNotUnderstand) {
  const std::string whole = binary({kTriangle, kTriangle});
  for (std::size_t length = 0; length < whole.size(); ++length)
    expect_words(stl_refusal(whole.substr(0, length)), {"f.stl: byte "});
  expect_words(stl_refusal(whole + "x"), {"f.stl: byte 80", "184", "185"});
  std::array<float, 9> bad = kTriangle;
  for (const float value :
       {std::numeric_limits<float>::quiet_NaN(), 1e9f, -std::numeric_limits<float>::infinity()}) {
    bad[4] = value;
    expect_words(stl_refusal(binary({kTriangle, bad})), {"f.stl: byte 162:", "triangle 2"});
  }
}

TEST(Stl, RefusesMoreTrianglesThanAnyCellNeeds) {
  std::string bytes(80, ' ');
  put(bytes, 400'001u);
  bytes.resize(84 + 50 * std::size_t{400'001}, '\0');
  expect_words(stl_refusal(bytes), {"f.stl: byte 80", "400001 triangles"});
  // A wrong triangle count is detected, without allocating memory for it.
  std::string lie(80, ' ');
  put(lie, 0xffffffffu);
  expect_words(stl_refusal(lie), {"f.stl: byte 80", "4294967295"});
}

}  // namespace
}  // namespace cellcal::calib
