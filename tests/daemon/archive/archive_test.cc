// A session as plain files: written, read, checked, imported into another journal.

#include "daemon/archive/archive.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>

#include "calib/files/calibration_json.h"
#include "calib/files/files.h"
#include "calib/files/input_file.h"
#include "daemon/journal/chain.h"
#include "daemon/journal/rows.h"
#include "daemon/tasks/options.h"
#include "tests/calib/random_calibration.h"
#include "tests/daemon/journal/temporary_directory.h"

namespace cellcal::daemon::testing {
namespace {

std::string refusal(const std::function<void()>& act) {
  try {
    act();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

/// A forgery: altered rows with recomputed sums.
Archive forged(Archive archive, const std::function<void(RowEntry&)>& alter) {
  SessionRows rows = parse_lines(archive.at("rows.jsonl"), "x");
  std::string before = rows.entries.front().before;
  std::int64_t number = rows.entries.front().number;
  for (RowEntry& entry : rows.entries) {
    alter(entry);
    if (!entry.names.empty()) {
      std::vector<Value> row{entry.row};
      row.insert(row.end(), entry.columns.begin(), entry.columns.end());
      entry.digest = digest_of(row);
    }
    entry.number = number++;
    entry.before = before;
    before = entry.sum =
        sum_of(entry.before, entry.number, rows.session, entry.table, entry.row, entry.digest);
  }
  archive["rows.jsonl"] = to_lines(rows);
  auto manifest = nlohmann::json::parse(archive.at("export.json"));
  manifest.erase("sum");
  for (nlohmann::json& file : manifest["files"])
    if (file["name"] == "rows.jsonl") file["sha256"] = calib::sha256(archive.at("rows.jsonl"));
  manifest["rows"]["entries_sum"] = sum_of_entries(rows, rows.entries.size());
  manifest["sum"] = calib::sha256(manifest.dump());
  archive["export.json"] = manifest.dump();
  return archive;
}

struct AnExport : ::testing::Test {
  AnExport() {
    SessionInputs inputs = read_inputs(CELLCAL_DEMO_CELL);
    const SessionOptions options;
    inputs.options = options_to_json(options);
    id = journal.begin(inputs, "2026-01-01T00:00:00.000Z");
    for (std::size_t i = 0; i < 3; ++i) {
      calib::Touch touch;
      touch.joint_rad = {0.1, -0.2, 0.3, 1.0 / 3.0, 0.5, static_cast<double>(i)};
      touch.target = "S1";
      RecordReading reading{i, 0, {}};
      for (const double angle : touch.joint_rad) reading.reading.contact_rad.push_back(angle);
      journal.record(id, reading);
      journal.record(id, RecordTouch{i, touch});
    }
    journal.note(id, "2026-01-01T00:30:00.000Z", "words");
    journal.store_calibration(id, calibration, Compared{"session 0", true, "{\"a\":1}"});
    journal.record(id, RecordEnd{Ending::kDone, ""}, "2026-01-01T01:00:00.000Z");
    std::filesystem::create_directories(dir / "results");
    std::ofstream(dir / "results" / "report.html") << "<html>";
    archive = make_archive(journal, id, dir / "results");
  }
  Imported import_into(Journal& into, const Archive& what) {
    return import_archive(into, what, "e", [this](std::int64_t session) {
      return dir / ("results-" + std::to_string(session));
    });
  }

  static std::string made() {
    calib::Random random(1);
    return calib::calibration_to_json(
        calib::testing::random_calibration(cell_of(read_inputs(CELLCAL_DEMO_CELL)), random));
  }

  const std::string calibration = made();
  TemporaryDirectory dir;
  Journal journal{dir / "j.db"};
  std::int64_t id = 0;
  Archive archive;
};

TEST_F(AnExport, HoldsInputsTouchesRowsAndResultsAsPlainFiles) {
  write_archive(archive, dir / "e");
  std::vector<std::string> names;
  for (const auto& file : std::filesystem::directory_iterator(dir / "e"))
    names.push_back(file.path().filename());
  std::sort(names.begin(), names.end());
  EXPECT_EQ(names, (std::vector<std::string>{"calibration.json", "cell.toml", "compared.json",
                                             "export.json", "options.json", "report.html",
                                             "robot.toml", "rows.jsonl", "touches.csv"}));
  EXPECT_EQ(read_archive(dir / "e"), archive);
  const calib::Cell cell = cell_of(journal.session(id)->inputs);
  EXPECT_EQ(calib::load_touches(dir / "e/touches.csv", cell).size(), 3u);
}

TEST_F(AnExport, MadeTwiceIsTheSame) {
  EXPECT_EQ(make_archive(journal, id, dir / "results"), archive);
}

TEST_F(AnExport, OfASessionThatIsNoneSaysSo) {
  EXPECT_NE(refusal([&] { make_archive(journal, 99, dir / "results"); }).find("no session 99"),
            std::string::npos);
}

TEST_F(AnExport, GoesIntoAnotherJournalWithItsResultAndOnce) {
  Journal other(dir / "other.db");
  const Imported imported = import_into(other, archive);
  EXPECT_TRUE(imported.is_new);
  EXPECT_EQ(other.touches(imported.session), journal.touches(id));
  EXPECT_EQ(other.compared(imported.session)->calibration, "{\"a\":1}");
  EXPECT_EQ(calib::read_file(dir / "results-1/calibration.json"), calibration);
  EXPECT_FALSE(std::filesystem::exists(dir / "results-1/report.html"))
      << "another's page must not be served as the daemon's own";
  EXPECT_FALSE(import_into(other, archive).is_new);
}

TEST_F(AnExport, IsRefusedByTheNameOfTheFileThatWasAlteredOrIsMissing) {
  for (const auto& [name, text] : archive) {
    Archive altered = archive;
    altered[name][text.size() / 2] ^= 1;
    EXPECT_NE(refusal([&] { check_archive(altered, "e"); }).find("e/" + name), std::string::npos)
        << name;
    altered = archive;
    altered.erase(name);
    EXPECT_NE(refusal([&] { check_archive(altered, "e"); }).find("e/" + name + ": is missing"),
              std::string::npos)
        << name;
  }
}

TEST_F(AnExport, OfAnotherFormatOrWithNamesOfItsOwnIsRefused) {
  const auto with = [&](const std::string& what, const std::string& by) {
    Archive altered = archive;
    std::string& manifest = altered["export.json"];
    manifest.replace(manifest.find(what), what.size(), by);
    return refusal([&] { check_archive(altered, "e"); });
  };
  EXPECT_NE(with("cellcal.export/1", "cellcal.export/2").find("Install the newer version"),
            std::string::npos);
  EXPECT_NE(with("\"touches\": 3", "\"touches\": 4").find("was changed after it was written"),
            std::string::npos);
  EXPECT_NE(with("report.html", "../../etc/x"), "");
  for (const std::string hostile : {"", "[]", "{}", "{\"format\":1}", "\xff"}) {
    Archive none{{"export.json", hostile}};
    EXPECT_NE(refusal([&] { check_archive(none, "e"); }).find("e/export.json"), std::string::npos);
  }
}

TEST_F(AnExport, WithAFileThatItDoesNotListIsRefusedAndNothingIsWritten) {
  for (const std::string name : {"../x", "/tmp/x", "compared.json2", "notes.txt"}) {
    Archive more = archive;
    more[name] = "x";
    EXPECT_NE(refusal([&] { write_archive(more, dir / "to"); }).find("not listed"),
              std::string::npos)
        << name;
  }
  EXPECT_FALSE(std::filesystem::exists(dir / "to"));
  EXPECT_FALSE(std::filesystem::exists(dir / "to.part"));
}

TEST_F(AnExport, ThatStatesOtherRowsThanItHoldsIsRefused) {
  const auto with = [&](const std::function<void(nlohmann::json&)>& alter) {
    Archive altered = archive;
    auto manifest = nlohmann::json::parse(altered.at("export.json"));
    manifest.erase("sum");
    alter(manifest);
    manifest["sum"] = calib::sha256(manifest.dump());  // as in a forgery
    altered["export.json"] = manifest.dump();
    Journal other(dir / "other.db");
    const std::string why = refusal([&] { import_into(other, altered); });
    EXPECT_TRUE(why.empty() || other.sessions().empty());
    return why;
  };
  EXPECT_NE(with([](auto& manifest) { manifest["touches"] = 4; }).find("3 of 4 touches"),
            std::string::npos);
  EXPECT_NE(with([](auto& manifest) { manifest["rows"]["entries"] = 2; }).find("other entries"),
            std::string::npos);
  EXPECT_NE(with([](auto& manifest) { manifest.erase("rows"); }).find("damaged"),
            std::string::npos);
  EXPECT_NE(with([](auto& manifest) { manifest.erase("touches"); }).find("damaged"),
            std::string::npos);
  EXPECT_EQ(with([](auto&) {}), "");
}

struct Forgery {
  const char *table, *column;
  Value value;
  const char* words;
};

TEST_F(AnExport, ThatHoldsWhatNoSessionHasIsRefusedByItsRowWhateverItsSums) {
  const auto angles = [](std::vector<double> values) {
    return Blob{std::string(reinterpret_cast<const char*>(values.data()), values.size() * 8)};
  };
  const double nan = std::nan(""), inf = HUGE_VAL;
  const Forgery all[] = {
      {"reading", "contact_rad", Blob{std::string(480, '\0')}, "has 480 bytes"},
      {"reading", "contact_rad", Blob{std::string(47, '\0')}, "has 47 bytes"},
      {"reading", "contact_rad", angles({1, 2, 3}), "has 3 angles, other rows 6"},
      {"reading", "slow", std::int64_t{7}, "must be 0 to 1"},
      {"reading", "along_m", inf, "must be finite"},
      {"reading", "bounces", std::int64_t{-1}, "must be 0 to"},
      {"touch", "joint_rad", Blob{}, "has 0 bytes"},
      {"touch", "joint_rad", Value(), "must be a blob"},
      {"touch", "joint_rad", std::string("123456"), "must be a blob"},
      {"touch", "joint_rad", angles({1, 2, 3, 4, 5, nan}), "must be finite"},
      {"touch", "target", std::string("S9"), "target \"S9\" is not in the cell"},
      {"touch", "target", std::string("S\xff"), "is not UTF-8"},
      {"touch", "target", std::string(), "is empty"},
      {"touch", "target", std::string("S1\nS2"), "has several lines"},
      {"touch", "tool", std::string("T7"), "tool \"T7\" is not in the cell"},
      {"touch", "sigma_m", -1e-5, "must not be negative"},
      {"touch", "held_out", std::string("1"), "must be a whole number"},
      {"touch", "tracker_m", angles({1, 2}), "has 16 bytes"},
      {"touch", "approach", angles({1, 2, 3, 4}), "has 32 bytes"},
      {"touch", "readings", std::int64_t{1} << 40, "must be 0 to"},
      {"event", "words", std::string("\xc0\x80"), "is not UTF-8"},
      {"event", "words", std::int64_t{3}, "must be a text"},
      {"session", "cell_text", std::string("[tool"), "cell"},
      {"session", "cell_text", std::string("\xff"), "is not UTF-8"},
      {"session", "robot_text", std::string("format = 1"), "format"},
      {"session", "options", std::string("[]"), "option"},
      {"session", "calibration", std::string("{}"), "calibration"},
      {"session", "planned", std::int64_t{-3}, "must be 0 to"},
  };
  for (const Forgery& one : all) {
    Journal other(dir / "other.db");
    bool altered = false;
    const Archive bad = forged(archive, [&](RowEntry& entry) {
      for (std::size_t i = 0; i < entry.names.size(); ++i)
        if (!altered && entry.table == one.table && entry.names[i] == one.column &&
            (one.table != std::string("reading") ||
             std::get<std::int64_t>(entry.columns[1]) == 1)) {
          entry.columns[i] = one.value;
          altered = true;
        }
    });
    EXPECT_TRUE(altered) << one.table << one.column;
    std::string why;
    try {
      import_into(other, bad);
    } catch (const ArchiveError& refused) {
      why = refused.what();
    } catch (const JournalError& refused) {
      why = refused.what();
    }
    EXPECT_NE(why.find("e/rows.jsonl:"), std::string::npos) << one.table << one.column << why;
    EXPECT_NE(why.find(std::string(" of '") + one.table + "': "), std::string::npos) << why;
    EXPECT_NE(why.find(one.words), std::string::npos) << one.table << one.column << why;
    EXPECT_EQ(why.find("json.exception"), std::string::npos) << why;
    EXPECT_TRUE(other.sessions().empty()) << one.table << one.column;
  }
  Journal other(dir / "other.db");
  EXPECT_TRUE(import_into(other, forged(archive, [](RowEntry&) {})).is_new) << "as it is";
}

TEST_F(AnExport, DoesNotRemoveWhatStandsWhereItIsMade) {
  std::filesystem::create_directories(dir / "to.part");
  std::ofstream(dir / "to.part/mine") << "x";
  EXPECT_NE(refusal([&] { write_archive(archive, dir / "to"); }).find("to.part"),
            std::string::npos);
  EXPECT_TRUE(std::filesystem::exists(dir / "to.part/mine"));
}

TEST_F(AnExport, WhoseColumnsWereExchangedIsNotImported) {
  std::string rows = archive.at("rows.jsonl");
  const auto exchange = [&](const std::string& what, const std::string& by) {
    for (std::size_t at = 0; (at = rows.find(what, at)) != std::string::npos; at += by.size())
      rows.replace(at, what.size(), by);
  };
  exchange("\"joint_rad\"", "\"#\"");
  exchange("\"settled_rad\"", "\"joint_rad\"");
  exchange("\"#\"", "\"settled_rad\"");
  ASSERT_NE(rows, archive.at("rows.jsonl"));
  Journal other(dir / "other.db");
  EXPECT_THROW(other.import(rows, "e/rows.jsonl"), JournalError);
  EXPECT_TRUE(other.sessions().empty());
}

TEST_F(AnExport, IsNotImportedIntoTheFolderOfALostSession) {
  const auto folder = dir / "results-1";
  std::filesystem::create_directories(folder);
  for (const char* name : {"calibration.json", "report.html"})
    std::ofstream(folder / name) << "of a lost session";
  Journal other(dir / "other.db");
  ASSERT_EQ(import_into(other, archive).session, 1);
  EXPECT_FALSE(std::filesystem::exists(folder / "report.html"));
  EXPECT_GT(std::filesystem::file_size(folder / "calibration.json"), 1000u);
  EXPECT_TRUE(std::filesystem::exists(dir / "results-1.before/report.html"));
}

TEST_F(AnExport, WhoseImportEndedBehindTheRowsIsCompletedByTheNext) {
  Journal other(dir / "other.db");
  const auto session = import_into(other, archive).session;
  const auto result = dir / ("results-" + std::to_string(session)) / "calibration.json";
  ASSERT_TRUE(std::filesystem::remove(result));
  EXPECT_FALSE(import_into(other, archive).is_new);
  EXPECT_TRUE(std::filesystem::exists(result));
}

TEST_F(AnExport, IsWrittenIntoNoDirectoryThatHoldsAnything) {
  std::filesystem::create_directories(dir / "full/x");
  EXPECT_NE(refusal([&] { write_archive(archive, dir / "full"); }).find("not empty"),
            std::string::npos);
  std::filesystem::create_directories(dir / "empty");
  write_archive(archive, dir / "empty");
  EXPECT_EQ(read_archive(dir / "empty"), archive);
  EXPECT_NE(refusal([&] { read_archive(dir / "nowhere"); }).find("cellcal export"),
            std::string::npos);
}

}  // namespace
}  // namespace cellcal::daemon::testing
