// The bytes as decoded by protoc without a schema: field numbers and wire types of the standard.

#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <fstream>
#include <random>

#include "daemon/plant/line/edge_node.h"
#include "sparkplug_b.pb.h"
#include "tests/daemon/journal/temporary_directory.h"

namespace cellcal::daemon::testing {
namespace {

using namespace plant::sparkplug;

std::string raw(const std::string& bytes) {
  const TemporaryDirectory dir;
  std::ofstream(dir / "payload", std::ios::binary) << bytes;
  const std::string command =
      std::string(CELLCAL_PROTOC) + " --decode_raw < " + (dir / "payload").string();
  std::string text;
  FILE* out = popen(command.c_str(), "r");
  std::array<char, 4096> part{};
  while (const std::size_t read = fread(part.data(), 1, part.size(), out))
    text.append(part.data(), read);
  EXPECT_EQ(pclose(out), 0);
  return text;
}

TEST(ABirth, HasNamesTimesTypesAndValuesUnderTheNumbersOfTheStandard) {
  EXPECT_EQ(raw(payload({{"bdSeq", DataType::kInt64, std::int64_t{3}},
                         {"mm", DataType::kDouble, 1.0},
                         {"on", DataType::kBoolean, true},
                         {"words", DataType::kString, std::string("one two")},
                         {"when", DataType::kDateTime, std::int64_t{1700000000000}}},
                        1500, 0, Types::kDeclared)),
            "1: 1500\n"
            "2 {\n  1: \"bdSeq\"\n  3: 1500\n  4: 4\n  11: 3\n}\n"
            "2 {\n  1: \"mm\"\n  3: 1500\n  4: 10\n  13: 0x3ff0000000000000\n}\n"
            "2 {\n  1: \"on\"\n  3: 1500\n  4: 11\n  14: 1\n}\n"
            "2 {\n  1: \"words\"\n  3: 1500\n  4: 12\n  15: \"one two\"\n}\n"
            "2 {\n  1: \"when\"\n  3: 1500\n  4: 13\n  11: 1700000000000\n}\n"
            "3: 0\n");
}

TEST(Data, HasNoTypesAndWhatIsNotKnownIsNull) {
  EXPECT_EQ(raw(payload({{"mm", DataType::kDouble, {}}, {"n", DataType::kInt64, std::int64_t{-1}}},
                        7, 255, Types::kKnown)),
            "1: 7\n2 {\n  1: \"mm\"\n  3: 7\n  7: 1\n}\n"
            "2 {\n  1: \"n\"\n  3: 7\n  11: 18446744073709551615\n}\n3: 255\n");
}

TEST(ADeath, HasNoSequenceNumber) {
  EXPECT_EQ(raw(payload({{"bdSeq", DataType::kInt64, std::int64_t{0}}}, 7, std::nullopt,
                        Types::kDeclared)),
            "1: 7\n2 {\n  1: \"bdSeq\"\n  3: 7\n  4: 4\n  11: 0\n}\n");
}

TEST(ACommand, AsksForABirthByThatMetricWithTrueAlone) {
  const auto command = [](const std::string& name, auto value) {
    return payload({{name, DataType::kBoolean, value}}, 1, std::nullopt, Types::kDeclared);
  };
  EXPECT_TRUE(asks_for_rebirth(command(kRebirth, true)));
  EXPECT_FALSE(asks_for_rebirth(command(kRebirth, false)));
  EXPECT_FALSE(asks_for_rebirth(command(kRebirth, std::int64_t{1})));
  EXPECT_FALSE(asks_for_rebirth(command("Node Control/Reboot", true)));
  EXPECT_FALSE(asks_for_rebirth(""));
}

TEST(ACommand, ThatIsCutOffOversizedOrNoiseAsksForNothing) {
  const std::string whole =
      payload({{kRebirth, DataType::kBoolean, true}}, 1, std::nullopt, Types::kDeclared);
  for (std::size_t size = 0; size < whole.size(); ++size)
    EXPECT_FALSE(asks_for_rebirth(std::string_view(whole).substr(0, size))) << size;
  EXPECT_FALSE(asks_for_rebirth(
      payload({{kRebirth, DataType::kBoolean, true},
               {"long", DataType::kString, std::string(std::size_t{1} << 17, 'x')}},
              1, std::nullopt, Types::kDeclared)));
  std::minstd_rand chance(1);
  for (int i = 0; i < 20000; ++i) {
    std::string noise = whole;
    for (int changes = 0; changes < 3; ++changes)
      noise[chance() % noise.size()] = static_cast<char>(chance());
    cellcal::sparkplug::Payload read;
    const bool sound = read.ParseFromString(noise) && read.metrics_size() == 1 &&
                       read.metrics(0).name() == kRebirth && read.metrics(0).boolean_value();
    EXPECT_EQ(asks_for_rebirth(noise), sound);
  }
}

}  // namespace
}  // namespace cellcal::daemon::testing
