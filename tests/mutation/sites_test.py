"""The sampler itself: positions of faults, and that a copy with all of them behaves like the
original while none is active, and like exactly one fault when that one is active."""

import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))
sys.dont_write_bytecode = True
from sites import Sites, enums_of, placed, rewritten  # noqa: E402

SAMPLE = """
#include <cstdio>
#include <string>
#include <vector>
// if (a < b) is a comment, and kept
enum class Kind { kNone, kTouch, kNoise };
static_assert(1 < 2);
namespace {
constexpr double kLimit = 0.5;
constexpr int kCount = 3;
constexpr int kSize = 4;
int table[kSize] = {};
struct Row { bool good; const char* why; };
constexpr Row kRows[] = {{true, "a reason"}};
}
struct Box { int lid = 0; };
template <class T> T twice(T t) { return t + t; }
int work(int a, int b, bool c) {
  Box box;
  int sum = a - b;
  if (a < b && !c) sum += kCount;
  if (c) box.lid = 2; else box.lid = 1;
  for (int rounds = 0; rounds < 90; ++rounds) {
    if (sum <= 40) break;
    --sum;
  }
  while (sum > 4000) return 0;
  const std::string text = "x < y" + std::to_string(box.lid);
  std::vector<int> values = {7, -a};
  const Kind kind = c || a == 1 ? Kind::kTouch : Kind::kNone;
  switch (kind) {
    case Kind::kNone: break;
    default: sum += 100; break;
  }
  for (int i = 0; i < 2; ++i) sum += values[i];
  for (const Row& row : kRows) sum += row.good ? 500 : 0;
  return sum + twice(box.lid) + static_cast<int>(text.size()) + (a * kLimit > 1.4 ? 1000 : 0) + table[0];
}
int main() {
  std::printf("%d %d %d %d", work(1, 2, false), work(1, 2, true), work(3, 3, false), work(50, 2, true));
}
"""


def sites_of(source):
    sites = Sites("sample.cc", source, enums_of([("sample.cc", source)]))
    for number, fault in enumerate((f for s in sites.sites for f in s.faults), 1):
        fault.number = number
    return sites


def faults_on(source, line):
    return {f"{f.before} -> {f.after}" for s in sites_of(source).sites for f in s.faults if f.line == line}


class Places(unittest.TestCase):
    def test_comments_strings_assertions_cases_and_declarations_are_left_alone(self):
        for number, line in enumerate(SAMPLE.split("\n"), 1):
            if line.startswith(("#", "//", "static_assert", "enum")) or "case " in line:
                self.assertEqual(faults_on(SAMPLE, number), set(), line)

    def test_every_kind_of_fault_is_found(self):
        found = {f"{f.before} -> {f.after}" for s in sites_of(SAMPLE).sites for f in s.faults}
        for fault in ("< -> <=", "< -> >=", "> -> >=", "== -> !=", "&& -> ||", "|| -> &&", "- -> +", "! -> ",
                      "+ -> -", "- -> ", "0.5 -> 1", "3 -> 4", "0 -> 1", "sum += kCount; -> (left out)",
                      "box.lid = 2; -> (left out)", "--sum; -> (left out)", "if (...) -> if (!(...))",
                      "Kind::kTouch -> Kind::kNoise", "Kind::kNone -> Kind::kTouch"):
            self.assertIn(fault, found)

    def test_brackets_of_templates_are_no_operators(self):
        line = 1 + next(i for i, l in enumerate(SAMPLE.split("\n")) if l.startswith("template"))
        self.assertEqual(faults_on(SAMPLE, line), {"+ -> -"})


class Copies(unittest.TestCase):
    def test_a_copy_is_the_original_until_a_fault_is_chosen(self):
        sites = sites_of(SAMPLE)
        with tempfile.TemporaryDirectory() as folder:
            original, copy = Path(folder, "original"), Path(folder, "copy")
            self.build(SAMPLE, original)
            # The array's size must be a constant: a compiler error, and these lines are omitted.
            dropped = {i for i, l in enumerate(SAMPLE.split("\n"), 1) if "kSize" in l}
            self.build(rewritten(sites, dropped), copy)
            right = self.run_with(original, 0)
            self.assertEqual(self.run_with(copy, 0), right)
            faults = placed(sites, dropped)
            self.assertGreater(len(faults), 30)
            changed = sum(self.run_with(copy, f.number) != right for f in faults)
            self.assertGreater(changed, 0.6 * len(faults))
            row, = (f.number for f in faults if f.line == self.line_of("a reason"))
            self.assertNotEqual(self.run_with(copy, row), right, "a table of constants with words in it")
            by = {f"{f.before} -> {f.after}": f.number for f in faults if f.line == self.line_of("a < b && !c")}
            for fault, text in (("&& -> ||", ("a < b && !c", "a < b || !c")), ("! -> ", ("!c", "c")),
                                ("< -> >=", ("a < b &&", "a >= b &&")),
                                ("< -> <=", ("a < b &&", "a <= b &&")),
                                ("sum += kCount; -> (left out)", ("sum += kCount;", ";"))):
                by_hand = Path(folder, "by_hand")
                self.build(SAMPLE.replace(*text, 1), by_hand)
                self.assertEqual(self.run_with(copy, by[fault]), self.run_with(by_hand, 0), fault)

    def line_of(self, words):
        return 1 + next(i for i, l in enumerate(SAMPLE.split("\n")) if words in l and "//" not in l)

    def build(self, source, program):
        compiler = os.environ.get("CXX", "c++")
        subprocess.run([compiler, "-std=c++20", "-O0", "-w", "-Wno-narrowing", "-fpermissive", "-x", "c++", "-",
                        "-include", str(HERE / "fault.h"), "-o", str(program)], input=source, text=True, check=True)

    def run_with(self, program, fault):
        done = subprocess.run([program], capture_output=True, text=True, timeout=10,
                              env=dict(os.environ, CELLCAL_FAULT=str(fault)))
        return done.stdout, done.returncode


if __name__ == "__main__":
    unittest.main()
