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
using namespace std::string_literals;

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

TEST(Stl, ReadsAsciiWhereverOneReadingIsLeft) {
  for (const char* before : {"\n", " \t", "\r\n\r\n", "\xEF\xBB\xBF", "\xEF\xBB\xBF  "})
    expect_the_triangle(parse_stl(before + ascii(kCorners), "f.stl"));
  std::string text = ascii(kCorners), apart = text;
  for (const char* word : {"loop", "facet", "solid"})
    apart.replace(apart.find("end" + std::string(word)), 3, "End  ");
  expect_the_triangle(parse_stl(apart, "f.stl"));
  EXPECT_EQ(parse_stl(apart + "\n" + apart, "f.stl").triangles.size(), 2u);
  expect_the_triangle(parse_stl(text.replace(0, 5, "Solid"), "f.stl"));
  expect_the_triangle(parse_stl(text.replace(0, 5, "SOLID"), "f.stl"));
  const std::string nul = "made\0by"s;
  expect_the_triangle(parse_stl(ascii(kCorners).replace(6, 7, nul), "f.stl"));
}

TEST(Stl, ReadsBinaryWhereverOneReadingIsLeft) {
  for (const std::string& header :
       {"x"s, "solid"s, "solid\0\0\0made by hand"s, "\nsolid facet normal"s}) {
    const std::string whole = binary({kTriangle, kTriangle}, header);
    EXPECT_EQ(parse_stl(whole, "f.stl").triangles.size(), 2u);
    for (const std::string& behind :
         {"x"s, "\0\0"s, "COLOR=... solid facet normal"s, std::string(1051, ' ')})
      EXPECT_EQ(parse_stl(whole + behind, "f.stl").triangles.size(), 2u) << behind;
    std::string uncounted = whole;
    uncounted[80] = '\0';
    EXPECT_EQ(parse_stl(uncounted, "f.stl").triangles.size(), 2u);
    expect_words(stl_refusal(uncounted + "x"), {"f.stl: no triangles"});
    // More facets than are counted, or another thing behind them.
    expect_words(stl_refusal(whole + binary({kTriangle}).substr(84)),
                 {"f.stl: byte 80", "184", "234"});
  }
}

TEST(Stl, NamesTheFormatOfAnotherFile) {
  for (const auto& [begins, format] : std::initializer_list<std::pair<std::string, std::string>>{
           {"ISO-10303-21;\nHEADER;\n", "STEP"},
           {"PK\x03\x04\x14\0"s, "3MF"},
           {"#VRML V2.0 utf8\n", "VRML"},
           {"# Blender 4.1\n# www.blender.org\n\nmtllib a.mtl\n", "OBJ"},
           {"\xEF\xBB\xBFv 0 0 0\nv 1 0 0\n", "OBJ"},
           {"o fixture\n", "OBJ"},
           {"ply\nformat ascii 1.0\n", "PLY"},
           {"<html>" + std::string(100, ' '), "f.stl: not an STL file"},
           {"###" + std::string(100, '#'), "f.stl: not an STL file"},
           {"vertices " + std::string(100, 'v'), "f.stl: not an STL file"}})
    for (const std::string& rest : {""s, std::string(3000, 'x')})
      expect_words(stl_refusal(begins + rest), {"f.stl: ", format});
  expect_words(stl_refusal("PK\x03\x04" + std::string(3000, '\0')), {"3MF"});
  const std::string words = stl_refusal("ISO-10303-21;" + std::string(200, ' '));
  expect_words(words, {"STEP, not an STL file", "Export it as STL in millimetres"});
  EXPECT_EQ(words.find("triangles"), std::string::npos) << words;
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
  expect_words(stl_refusal(lie), {"f.stl: not an STL file"});
  lie.resize(80);
  put(lie, 400'000u);
  expect_words(stl_refusal(lie), {"f.stl: byte 80", "20000084"});
  std::string uncounted(84 + 50 * std::size_t{400'001}, '\0');
  expect_words(stl_refusal(uncounted), {"f.stl: byte 80", "400001 triangles"});
}

}  // namespace
}  // namespace cellcal::calib
