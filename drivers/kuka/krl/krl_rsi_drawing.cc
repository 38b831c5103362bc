#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <vector>

#include "drivers/kuka/krl/krl_rsi_parts.h"
#include "drivers/kuka/wire/xml_values.h"

namespace cellcal::drivers::krl {
namespace {

// In inches, following the editor's own layout.
constexpr double kTop = 2.25, kWide = 1.5, kFirstPort = 0.25, kPortStep = 0.4, kPortLong = 0.4,
                 kPortThick = 0.075, kPad = 0.3, kColumn = 3.125, kLeft = 1.0;
// The editor's name for 'is connected to'.
constexpr const char* kConnector = "e3f2b7da-330d-4daf-bd29-4d4ed734c0af";

struct Shape {
  std::string object;
  std::vector<std::string> in, out;
};

std::vector<std::string> names(const char* front, int count) {
  std::vector<std::string> result;
  for (int i = 1; i <= count; ++i) result.push_back(fmt::format("{}{}", front, i));
  return result;
}

/// Component names of a frame.
std::vector<std::string> frame_names(const std::string& front) {
  std::vector<std::string> result;
  for (const char letter : wire::kFrameNames) result.push_back(front + letter);
  return result;
}

std::vector<Shape> shapes(const RsiFilesConfig& config, const std::vector<RsiStateSource>& state) {
  const bool space = config.space.on;
  const int travelling = static_cast<int>(config.external.size());
  std::vector<std::string> values = space ? frame_names("") : names("A", 6);
  std::vector<std::string> with_status = values, all = names("A", 6);
  with_status.insert(with_status.begin(), "Stat");
  for (const std::string& external : names("E", 6)) all.push_back(external);
  std::vector<Shape> result{{"ETHERNET1", names("In", static_cast<int>(state.size()) + 1),
                             names("Out", kTravelChannel - 1 + travelling)}};
  if (space) {
    result.push_back({"POSCORR1", frame_names("Corr"), with_status});
    result.push_back({"POSCORRMON1", {}, values});
  } else {
    result.push_back({"AXISCORR1", names("CorrA", 6), with_status});
  }
  if (travelling > 0) {
    std::vector<std::string> axes = names("E", travelling);
    axes.insert(axes.begin(), "Stat");
    result.push_back({"AXISCORREXT1", names("CorrE", travelling), axes});
  }
  result.push_back({"AXISCORRMON1", {}, all});
  result.push_back({"STOP1", {"In1"}, {}});
  for (const RsiStateSource& one : state) result.push_back({object_id(one, 3), {}, {one.output}});
  return result;
}

class Drawing {
 public:
  std::string text(const RsiFilesConfig& config) {
    std::string body;
    double left = kLeft;
    const std::vector<RsiStateSource> state = state_sources(config);
    const std::vector<Shape> all = shapes(config, state);
    for (const Shape& shape : all) {
      body += draw(shape, left);
      left += kColumn;
    }
    const Shape& corrector = all[1];
    for (std::size_t i = 0; i < corrector.in.size(); ++i)
      body += connect(fmt::format("{}/{}", corrector.object, corrector.in[i]),
                      fmt::format("ETHERNET1/Out{}", i + 1));
    body += connect("STOP1/In1", fmt::format("ETHERNET1/Out{}", corrector.in.size() + 1));
    for (int i = 0; i < static_cast<int>(config.external.size()); ++i)
      body += connect(fmt::format("AXISCORREXT1/CorrE{}", i + 1),
                      fmt::format("ETHERNET1/Out{}", kTravelChannel + i));
    for (std::size_t i = 0; i < state.size(); ++i)
      body += connect(fmt::format("ETHERNET1/In{}", i + 1),
                      fmt::format("{}/{}", object_id(state[i], 3), state[i].output));
    return fmt::format(
        "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n"
        "<rSIObjectDiagram dslVersion=\"1.0.0.0\" absoluteBounds=\"0, 0, 15.875, 8.5\" "
        "name=\"cellcal_rsi\">\n  <rSIModelMoniker name=\"/\" />\n  <nestedChildShapes>\n{}"
        "  </nestedChildShapes>\n</rSIObjectDiagram>\n",
        body);
  }

 private:
  struct Port {
    std::string id;
    double x = 0.0, y = 0.0;  ///< of the end of a connecting line
  };

  /// Unique within the drawing; deterministic, so that sets can be compared.
  std::string next_id() { return fmt::format("ce11ca10-0000-4000-8000-{:012x}", ++ids_); }

  std::string port(const char* kind, const std::string& path, double x, double y, double end) {
    const Port made{next_id(), end, y + kPortThick / 2};
    ports_[path] = made;
    return fmt::format(
        "        <{0}Shape Id=\"{1}\" absoluteBounds=\"{2}, {3}, {4}, {5}\" fillColor=\"White\">\n"
        "          <{0}Moniker name=\"//{6}\" />\n          <relativeChildShapes />\n"
        "        </{0}Shape>\n",
        kind, made.id, x, y, kPortLong, kPortThick, path);
  }

  std::string draw(const Shape& shape, double left) {
    const std::size_t rows = std::max<std::size_t>({shape.in.size(), shape.out.size(), 1});
    const double high = kFirstPort + kPortStep * static_cast<double>(rows) + kPad;
    std::string text = fmt::format(
        "    <rSIElementShape Id=\"{}\" absoluteBounds=\"{}, {}, {}, {:.3f}\" "
        "fillColor=\"BlanchedAlmond\">\n      <rSIElementMoniker name=\"//{}\" />\n"
        "      <relativeChildShapes>\n",
        next_id(), left, kTop, kWide, high, shape.object);
    double y = kTop + kFirstPort;
    for (const std::string& one : shape.in) {
      text += port("rSIInPort", fmt::format("{}/{}", shape.object, one), left - kPortLong, y,
                   left - kPortLong);
      y += kPortStep;
    }
    y = kTop + kFirstPort;
    for (const std::string& one : shape.out) {
      text += port("rSIOutPort", fmt::format("{}/{}", shape.object, one), left + kWide, y,
                   left + kWide + kPortLong);
      y += kPortStep;
    }
    return text + fmt::format(
                      "      </relativeChildShapes>\n      <nestedChildShapes>\n"
                      "        <elementListCompartment Id=\"{}\" absoluteBounds=\"{}, {}, {}, {}\" "
                      "name=\"RSIParameters\" titleTextColor=\"Black\" itemTextColor=\"Black\" />\n"
                      "      </nestedChildShapes>\n    </rSIElementShape>\n",
                      next_id(), left + 0.015, kTop + 0.51, kWide - 0.03, high - 0.6);
  }

  std::string connect(const std::string& to, const std::string& from) {
    const Port& in = ports_.at(to);
    const Port& out = ports_.at(from);
    return fmt::format(
        "    <rSISignalConnector edgePoints=\"[({} : {}); ({} : {})]\" fixedFrom=\"Caller\" "
        "fixedTo=\"Caller\" TargetRelationshipDomainClassId=\"{}\">\n      <nodes>\n"
        "        <rSIInPortShapeMoniker Id=\"{}\" />\n        <rSIOutPortShapeMoniker Id=\"{}\" "
        "/>\n"
        "      </nodes>\n    </rSISignalConnector>\n",
        in.x, in.y, out.x, out.y, kConnector, in.id, out.id);
  }

  std::uint64_t ids_ = 0;
  std::map<std::string, Port> ports_;
};

}  // namespace

std::string rsi3_diagram(const RsiFilesConfig& config) { return Drawing().text(config); }

}  // namespace cellcal::drivers::krl
