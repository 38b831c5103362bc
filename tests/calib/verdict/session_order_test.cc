// Order of touches: by time if all have one, otherwise the order of the rows.

#include "calib/verdict/session_order.h"

#include <gtest/gtest.h>

#include "calib/model/iso_time.h"

namespace cellcal::calib {
namespace {

std::vector<std::size_t> order_of(const std::vector<const char*>& times) {
  std::vector<Touch> touches(times.size());
  for (std::size_t i = 0; i < times.size(); ++i) touches[i].time = times[i];
  return in_order(touches);
}
using Order = std::vector<std::size_t>;

TEST(TimeOrder, IsTheTimeColumnsWhereEveryTouchHasOne) {
  EXPECT_EQ(order_of({"2024-09-24T10:00:02Z", "2024-09-24T10:00:00Z", "2024-09-24T10:00:01Z"}),
            (Order{1, 2, 0}));
}

TEST(TimeOrder, IsThatOfTheRowsWhereATimeIsMissingOrNone) {
  EXPECT_EQ(order_of({"2024-09-24T10:00:02Z", "", "2024-09-24T10:00:01Z"}), (Order{0, 1, 2}));
  EXPECT_EQ(order_of({"second", "first"}), (Order{0, 1}));
}

TEST(TimeOrder, DoesNotDependOnHowATimeIsWritten) {
  EXPECT_EQ(order_of({"2024-09-24T10:00:00.5Z", "2024-09-24T11:59:59+02:00", "2024-09-24 10:00:00Z",
                      "20240924T100001Z", "2024-09-24"}),
            (Order{4, 1, 2, 0, 3}));
}

TEST(TimeOrder, KeepsTheRowsOfOneInstantAsTheyStand) {
  EXPECT_EQ(order_of({"2024-09-24T10:00:01Z", "2024-09-24T10:00:00Z", "2024-09-24T10:00:01Z",
                      "2024-09-24T10:00:00Z"}),
            (Order{1, 3, 0, 2}));
}

TEST(IsoTime, CountsFrom1970AndTakesUtcWhereNoZoneIs) {
  EXPECT_EQ(seconds_of("1970-01-01T00:00:00Z"), 0.0);
  EXPECT_EQ(seconds_of("1970-01-02"), 86400.0);
  EXPECT_EQ(seconds_of("2024-02-29T23:59:60Z"), seconds_of("2024-03-01T00:00:00"));
  EXPECT_EQ(seconds_of("2000-01-01T05:30+05:30"), seconds_of("2000-01-01T00:00Z"));
  EXPECT_EQ(seconds_of("2000-01-01T00:00-0130"), seconds_of("2000-01-01T01:30Z"));
  EXPECT_NEAR(*seconds_of("2000-01-01T00:00:00.125"), 946684800.125, 1e-6);
  EXPECT_EQ(seconds_of("2000-01-01 00:00:00,125Z"), seconds_of("2000-01-01T00:00:00.125"));
}

TEST(IsoTime, IsWrittenInUtc) {
  namespace chrono = std::chrono;
  const chrono::sys_seconds time{chrono::seconds(946684800)};
  EXPECT_EQ(utc_text(time), "2000-01-01T00:00:00Z");
  EXPECT_EQ(utc_text(time + chrono::milliseconds(7)), "2000-01-01T00:00:00.007Z");
  EXPECT_EQ(utc_text(time - chrono::milliseconds(1)), "1999-12-31T23:59:59.999Z");
}

TEST(IsoTime, RefusesWhatIsNone) {
  for (const char* none : {"",
                           "now",
                           "2024",
                           "2024-13-01",
                           "2024-02-30",
                           "2024-9-24",
                           "24.09.2024",
                           "2024-0924",
                           "2024-09-24T",
                           "2024-09-24T10",
                           "2024-09-24T25:00",
                           "2024-09-24T10:61",
                           "2024-09-24T10:00:",
                           "2024-09-24T10:00:61",
                           "2024-09-24T10:00:00.",
                           "2024-09-24T10:00:00.Z",
                           "2024-09-24T10:00:00,",
                           "2024-09-24T10,5",
                           "2024-09-24T10:00:00X",
                           "2024-09-24T10:00:00+",
                           "2024-09-24T10:00:00+2",
                           "2024-09-24T10:00:00Z ",
                           "-024-09-24",
                           "99999999999999999999"})
    EXPECT_FALSE(seconds_of(none)) << none;
}

}  // namespace
}  // namespace cellcal::calib
