#include <array>

#include "daemon/web/assets.h"

namespace cellcal::daemon {

namespace {

constexpr const char* kHtml = "text/html; charset=utf-8";
constexpr std::array kAssets{
    Asset{
        "/", kHtml, "\"none\"",
        "<!DOCTYPE html>\n<html lang=\"en\"><title>cellcald</title>\n"
        "<h1>cellcald runs. Its page was left out of this build.</h1>\n"
        "<p>Build it again where node (18.17 or newer) and npm are: <code>tests/install page</code>, "
        "then <code>cmake --preset release -DCELLCAL_PAGE=ON</code> and <code>cmake --build --preset "
        "release</code>.</p>\n<p>Everything else works without it: <code>cellcal status</code>, "
        "<code>cellcal watch</code>, <code>cellcal abort</code>.</p></html>\n",
        false},
    Asset{"/fleet", kHtml, "\"none-fleet\"",
          "<!DOCTYPE html>\n<html lang=\"en\"><title>cellcal-fleet</title>\n"
          "<h1>cellcal-fleet runs. Its page was left out of this build.</h1>\n"
          "<p>Everything else works without it: <code>cellcal fleet status</code>.</p></html>\n",
          false}};

}  // namespace

std::span<const Asset> assets() { return kAssets; }

}  // namespace cellcal::daemon
