#include "calib/export/urdf.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <pugixml.hpp>
#include <set>
#include <sstream>

#include "calib/export/tables.h"
#include "calib/files/text.h"
#include "calib/model/error.h"
#include "calib/model/units.h"

namespace cellcal::calib {

namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr std::size_t kMostJoints = 1000;
/// Metres and radians: larger values do not occur in a URDF.
constexpr double kLargest = 1e4;

struct UrdfJoint {
  pugi::xml_node node;
  std::string name, type, parent, child;
  Isometry3d origin;
  Vector3d axis;
  bool turns() const { return type == "revolute" || type == "continuous"; }
  bool slides() const { return type == "prismatic"; }
  bool moves() const { return turns() || slides(); }
};

struct Document {
  std::string_view text;
  pugi::xml_document xml;
  std::string name;  ///< of the file
  pugi::xml_node robot;
  std::vector<UrdfJoint> joints;

  [[noreturn]] void fail(const std::string& words) const { throw FileError(name, ": " + words); }
  std::ptrdiff_t line_at(std::ptrdiff_t offset) const {
    const auto end = std::clamp<std::ptrdiff_t>(offset, 0, std::ssize(text));
    return 1 + std::count(text.begin(), text.begin() + end, '\n');
  }
  [[noreturn]] void fail(const pugi::xml_node& node, const std::string& words) const {
    throw FileError(name, fmt::format(":{}: {}", line_at(node.offset_debug()), words));
  }
};

Vector3d three(const Document& document, const UrdfJoint& joint, const pugi::xml_node& node,
               const char* attribute, const Vector3d& otherwise) {
  const pugi::xml_attribute found = node.attribute(attribute);
  if (!found) return otherwise;
  const auto values = three_numbers(found.value());
  if (!values || values->cwiseAbs().maxCoeff() > kLargest)
    document.fail(fmt::format("joint \"{}\": <{}> {}=\"{}\" is not three numbers up to {}",
                              shown(joint.name), node.name(), attribute, shown(found.value()),
                              kLargest));
  return *values;
}

UrdfJoint read_joint(const Document& document, const pugi::xml_node& node) {
  UrdfJoint joint;
  joint.node = node;
  joint.name = node.attribute("name").value();
  joint.type = node.attribute("type").value();
  joint.parent = node.child("parent").attribute("link").value();
  joint.child = node.child("child").attribute("link").value();
  if (joint.name.empty() || joint.parent.empty() || joint.child.empty())
    document.fail(fmt::format("joint \"{}\" needs name, parent and child", shown(joint.name)));
  const pugi::xml_node origin = node.child("origin");
  joint.origin =
      Eigen::Translation3d(three(document, joint, origin, "xyz", Vector3d::Zero())) *
      Eigen::Quaterniond(rotation_of(three(document, joint, origin, "rpy", Vector3d::Zero())));
  joint.axis = three(document, joint, node.child("axis"), "xyz", Vector3d::UnitX());
  const double length = joint.axis.norm();
  if (joint.moves() && !(length > 1e-6 && length < 1e6))
    document.fail(fmt::format("joint \"{}\": <axis> has no direction", shown(joint.name)));
  joint.axis /= joint.moves() ? length : 1.0;
  return joint;
}

void refuse_xacro(const Document& document) {
  const pugi::xml_node found = document.xml.find_node([](const pugi::xml_node& node) {
    return std::string_view(node.name()).starts_with("xacro:");
  });
  if (found)
    document.fail(found, fmt::format("<{}>: a xacro file. Expand it first: xacro {} > robot.urdf",
                                     shown(found.name()), document.name));
}

/// A reference position that is not 0: the joint's zero may be another than the controller's.
void refuse_calibration(const Document& document, const UrdfJoint& joint) {
  const pugi::xml_node calibration = joint.node.child("calibration");
  for (const char* edge : {"rising", "falling"}) {
    const pugi::xml_attribute at = calibration.attribute(edge);
    if (!at || number(at.value()) == 0.0) continue;
    document.fail(calibration,
                  fmt::format("joint \"{}\": <calibration {}=\"{}\">: a reference position other "
                              "than 0. Remove it where the joint's zero is the controller's; "
                              "otherwise turn the joint's <origin> by it",
                              shown(joint.name), edge, shown(at.value())));
  }
}

/// Throws unless the document is a robot whose joints form a tree.
void read(Document& document, std::string_view text) {
  document.text = text;
  if (text.size() > kMostUrdfBytes)
    document.fail(fmt::format("{} bytes (limit {})", text.size(), kMostUrdfBytes));
  const pugi::xml_parse_result parsed = document.xml.load_buffer(
      text.data(), text.size(), pugi::parse_full | pugi::parse_ws_pcdata, pugi::encoding_utf8);
  if (!parsed)
    document.fail(
        fmt::format("line {}: {}", document.line_at(parsed.offset), parsed.description()));
  refuse_xacro(document);
  document.robot = document.xml.child("robot");
  if (!document.robot) document.fail("no <robot>. Is it a URDF?");
  std::set<std::string> children, names;
  for (const pugi::xml_node& node : document.robot.children("joint")) {
    if (document.joints.size() >= kMostJoints)
      document.fail(fmt::format("more than {} joints", kMostJoints));
    document.joints.push_back(read_joint(document, node));
    const UrdfJoint& joint = document.joints.back();
    if (!names.insert(joint.name).second)
      document.fail(fmt::format("two joints \"{}\"", shown(joint.name)));
    if (!children.insert(joint.child).second)
      document.fail(fmt::format("link \"{}\" is the child of two joints", shown(joint.child)));
  }
  if (document.joints.empty()) document.fail("no <joint>");
}

const UrdfJoint* joint_above(const Document& document, const std::string& link) {
  for (const UrdfJoint& joint : document.joints)
    if (joint.child == link) return &joint;
  return nullptr;
}

/// Joints from the root to the link.
std::vector<const UrdfJoint*> path_to(const Document& document, const std::string& link) {
  std::vector<const UrdfJoint*> path;
  for (const UrdfJoint* at = joint_above(document, link); at != nullptr;
       at = joint_above(document, at->parent)) {
    path.push_back(at);
    if (path.size() > document.joints.size()) document.fail("its joints form a loop");
  }
  std::reverse(path.begin(), path.end());
  return path;
}

using Path = std::vector<const UrdfJoint*>;

/// The joint that this one mimics; empty: none.
std::string_view leader(const UrdfJoint& joint) {
  return joint.node.child("mimic").attribute("joint").value();
}
bool follows(const UrdfJoint& joint) { return joint.node.child("mimic"); }

bool passes(const Path& path, const std::string& link) {
  return std::ranges::find(path, link, &UrdfJoint::parent) != path.end();
}

/// A gripper's: its followers hang on the same link as it, or further out.
bool drives_a_gripper(const Document& document, const UrdfJoint& joint) {
  return std::ranges::any_of(document.joints, [&](const UrdfJoint& other) {
    return leader(other) == joint.name &&
           (other.parent == joint.parent || passes(path_to(document, other.parent), joint.parent));
  });
}

bool is_named(const std::string& link, const std::string& usual) {
  return link == usual || link.ends_with("_" + usual);  // robot1_tool0 of a prefix, too
}

/// As far as the flange: to a tool0 that it passes, and without a gripper's joints.
Path up_to_flange(const Document& document, Path path) {
  const auto tool0 =
      std::ranges::find_if(path, [](const UrdfJoint* j) { return is_named(j->child, "tool0"); });
  if (tool0 != path.end() &&
      std::any_of(path.begin(), tool0, [](const UrdfJoint* j) { return j->turns(); }))
    path.erase(tool0 + 1, path.end());
  for (auto last = path.end(); last != path.begin();) {
    const UrdfJoint& joint = **--last;
    if (is_named(joint.child, "tool0") || is_named(joint.child, "flange")) break;
    if (!joint.moves()) continue;
    if (joint.turns() && !follows(joint) && !drives_a_gripper(document, joint)) break;
    last = path.erase(last, path.end());
  }
  return path;
}

std::ptrdiff_t turning(const Path& path) {
  return std::count_if(path.begin(), path.end(), [](const UrdfJoint* j) { return j->turns(); });
}

std::string chosen_tip(const Document& document, const std::string& asked) {
  if (!asked.empty()) {
    if (joint_above(document, asked) == nullptr)
      document.fail(fmt::format("no link \"{}\" below a joint", shown(asked)));
    return asked;
  }
  std::ptrdiff_t most = 0;
  std::vector<std::string> tips;
  for (const UrdfJoint& joint : document.joints) {
    const Path path = up_to_flange(document, path_to(document, joint.child));
    const auto count = turning(path);
    if (count == 0 || count < most) continue;
    if (count > most) tips.clear();
    most = count;
    const std::string& link = path.back()->child;
    if (std::ranges::find(tips, link) == tips.end()) tips.push_back(link);
  }
  const auto last_turning = [&](const std::string& link) {
    const auto path = path_to(document, link);
    return *std::find_if(path.rbegin(), path.rend(), [](const UrdfJoint* j) { return j->turns(); });
  };
  if (most == 0) document.fail("no joint that turns (revolute or continuous)");
  for (const std::string& link : tips)
    if (last_turning(link) != last_turning(tips.front()))
      document.fail(
          fmt::format("two chains of {} joints end at \"{}\" and \"{}\". Name the one: --tip LINK",
                      most, shown(tips.front()), shown(link)));
  for (const std::string usual : {"tool0", "flange"})
    for (const std::string& tip : tips)
      if (is_named(tip, usual)) return tip;
  return tips.front();
}

double attribute_or_zero(const Document& document, const UrdfJoint& joint,
                         const pugi::xml_node& node, const char* attribute) {
  const pugi::xml_attribute found = node.attribute(attribute);
  if (!found) return 0.0;
  const auto value = number(found.value());
  if (!value)
    document.fail(fmt::format("joint \"{}\": {}=\"{}\" is not a number", shown(joint.name),
                              attribute, shown(found.value())));
  return *value;
}

void read_link(const Document& document, const UrdfJoint& joint, PlacedJoint& placed) {
  for (const pugi::xml_node& link : document.robot.children("link")) {
    if (link.attribute("name").value() != joint.child) continue;
    const pugi::xml_node inertial = link.child("inertial");
    placed.mass_kg = attribute_or_zero(document, joint, inertial.child("mass"), "value");
    placed.com_m = three(document, joint, inertial.child("origin"), "xyz", Vector3d::Zero());
    constexpr double kMostKg = 1e4, kMostM = 100.0;  // of a robot file
    if (!(placed.mass_kg >= 0.0 && placed.mass_kg <= kMostKg) ||
        placed.com_m.cwiseAbs().maxCoeff() > kMostM)
      document.fail(
          inertial,
          fmt::format("link \"{}\": {:g} kg at {:g} {:g} {:g} m; up to {:g} kg within {:g} m are "
                      "allowed. Correct its <inertial>, or take it out",
                      shown(joint.child), placed.mass_kg, placed.com_m.x(), placed.com_m.y(),
                      placed.com_m.z(), kMostKg, kMostM));
  }
}

/// A chain, and the file's joints that move in it.
struct Chain {
  UrdfChain chain;
  std::vector<const UrdfJoint*> moving;
  std::vector<Isometry3d> fixed_before;  ///< fixed transforms before each of them
};

/// Joints and links outside the chain.
void look_around(const Document& document, Chain& found, bool chosen) {
  UrdfChain& chain = found.chain;
  const UrdfJoint& last = *found.moving.back();
  const bool usual = is_named(chain.tip_link, "tool0") || is_named(chain.tip_link, "flange");
  for (const UrdfJoint& joint : document.joints) {
    const Path path = path_to(document, joint.child);
    const auto behind = std::ranges::find(path, &last);
    if (joint.moves() && behind == path.end() - 1) continue;  // the last one
    if (joint.moves() && behind != path.end()) {
      chain.behind.push_back(joint.name);
      continue;
    }
    for (const UrdfJoint* one : found.moving)
      if (leader(joint) == one->name) chain.followed.emplace_back(one->name, joint.name);
    if (!chosen || usual || behind == path.end() ||
        std::any_of(behind + 1, path.end(), [](const UrdfJoint* j) { return j->moves(); }))
      continue;
    Isometry3d place = chain.frames.flange.inverse();
    for (auto at = behind + 1; at != path.end(); ++at) place = place * (*at)->origin;
    if (!place.isApprox(Isometry3d::Identity(), 1e-9))
      chain.other_flanges.emplace_back(joint.child, place);
  }
  if (chosen && !usual && chain.tip_link != last.child)
    chain.other_flanges.emplace_back(last.child, chain.frames.flange.inverse());
}

Chain chain_of(const Document& document, const UrdfEnds& asked) {
  Chain found;
  UrdfChain& chain = found.chain;
  chain.robot_name = document.robot.attribute("name").value();
  chain.tip_link = chosen_tip(document, asked.tip);
  auto path = path_to(document, chain.tip_link);
  // The arm's place in its cell is not part of the arm, how it is mounted there is.
  auto from = path.begin();
  const bool in_world = path.front()->parent == "world";
  if (!asked.root.empty()) {
    from = std::ranges::find(path, asked.root, &UrdfJoint::parent);
    if (from == path.end())
      document.fail(
          fmt::format("no chain of joints leads from link \"{}\" to link \"{}\". Check "
                      "--root and --tip",
                      shown(asked.root), shown(chain.tip_link)));
  } else if (path.size() > 1 && path.front()->type == "fixed" && in_world)
    ++from;
  for (auto before = path.begin(); in_world && before != from; ++before)
    chain.mounted *= (*before)->origin.linear();
  path.erase(path.begin(), from);
  chain.base_link = path.front()->parent;
  Isometry3d fixed = Isometry3d::Identity();
  for (const UrdfJoint* joint : path) {
    if (joint->type == "fixed") {
      fixed = fixed * joint->origin;
      continue;
    }
    if (!joint->turns() && !(joint->slides() && found.moving.empty()))
      document.fail(
          fmt::format("joint \"{}\" is {}. Only revolute, continuous and fixed joints "
                      "can be in the chain, and before them a prismatic one that carries the arm",
                      shown(joint->name), shown(joint->type)));
    if (follows(*joint))
      document.fail(
          joint->node,
          fmt::format(
              "joint \"{}\" mimics \"{}\". In the chain each joint has to turn by itself: name a "
              "link before it (--tip LINK), or behind it (--root LINK); an arm with such a joint in "
              "its middle cannot be calibrated",
              shown(joint->name), shown(std::string(leader(*joint)))));
    refuse_calibration(document, *joint);
    PlacedJoint& placed = chain.frames.joints.emplace_back();
    placed.name = joint->name;
    placed.slides = joint->slides();
    placed.origin = fixed * joint->origin;
    placed.axis = joint->axis;
    const pugi::xml_node limit = joint->node.child("limit");
    placed.min_rad = attribute_or_zero(document, *joint, limit, "lower");
    placed.max_rad = attribute_or_zero(document, *joint, limit, "upper");
    placed.max_speed_rad_s = attribute_or_zero(document, *joint, limit, "velocity");
    if (joint->type == "continuous" && placed.min_rad == 0.0 && placed.max_rad == 0.0) {
      placed.min_rad = -kRadPerTurn;
      placed.max_rad = kRadPerTurn;
      chain.unlimited.push_back(joint->name);
    }
    read_link(document, *joint, placed);
    found.moving.push_back(joint);
    found.fixed_before.push_back(fixed);
    fixed = Isometry3d::Identity();
  }
  chain.frames.flange = fixed;
  chain.ends_at_joint = chain.tip_link == found.moving.back()->child;
  look_around(document, found, asked.tip.empty());
  return found;
}

void put(pugi::xml_node node, const char* name, const Vector3d& values) {
  pugi::xml_attribute attribute = node.attribute(name);
  if (!attribute) attribute = node.append_attribute(name);
  attribute.set_value(shortest(values).c_str());
}

void put_origin(pugi::xml_node joint, const Isometry3d& frame) {
  pugi::xml_node origin = joint.child("origin");
  if (!origin) origin = joint.prepend_child("origin");
  put(origin, "xyz", frame.translation());
  put(origin, "rpy", roll_pitch_yaw(frame.linear()));
}

void put_axis(pugi::xml_node joint, const Vector3d& axis) {
  pugi::xml_node node = joint.child("axis");
  if (!node) node = joint.append_child("axis");
  put(node, "xyz", axis);
}

void append_link(pugi::xml_node robot, const std::string& name) {
  robot.append_child("link").append_attribute("name").set_value(name.c_str());
}

pugi::xml_node append_joint(pugi::xml_node robot, const std::string& name, const char* type,
                            const std::string& parent, const std::string& child,
                            const Isometry3d& origin) {
  pugi::xml_node node = robot.append_child("joint");
  node.append_attribute("name").set_value(name.c_str());
  node.append_attribute("type").set_value(type);
  put_origin(node, origin);
  node.append_child("parent").append_attribute("link").set_value(parent.c_str());
  node.append_child("child").append_attribute("link").set_value(child.c_str());
  return node;
}

/// A link, and the joint that moves it.
void append_moving(pugi::xml_node robot, const PlacedJoint& one, const std::string& parent,
                   const std::string& link) {
  append_link(robot, link);
  pugi::xml_node node =
      append_joint(robot, ros_joint_name(one.name), one.slides ? "prismatic" : "revolute", parent,
                   link, one.origin);
  put_axis(node, one.axis);
  pugi::xml_node limit = node.append_child("limit");
  limit.append_attribute("lower").set_value(shortest(one.min_rad).c_str());
  limit.append_attribute("upper").set_value(shortest(one.max_rad).c_str());
  limit.append_attribute("velocity").set_value(shortest(one.max_speed_rad_s).c_str());
  limit.append_attribute("effort").set_value("0");
}

/// The second chain: positioner_1, positioner_2 from the link of the base frame.
void append_positioner(pugi::xml_node robot, const JointFrames& frames, std::string parent) {
  for (std::size_t j = 0; j < frames.positioner.size(); ++j) {
    const std::string link = fmt::format("positioner_{}", j + 1);
    append_moving(robot, frames.positioner[j], parent, link);
    parent = link;
  }
}

/// "--" is not allowed within an XML comment.
std::string commentable(std::string text) {
  for (std::size_t at = 0; (at = text.find("--", at)) != std::string::npos;) text[at + 1] = ' ';
  return text;
}

/// A document that has a positioner of its own.
void refuse_second(const Document& document, const JointFrames& frames) {
  for (std::size_t j = 0; j < frames.positioner.size(); ++j) {
    const std::string joint = ros_joint_name(frames.positioner[j].name),
                      link = fmt::format("positioner_{}", j + 1);
    for (const pugi::xml_node& node : document.robot.children()) {
      const std::string_view name = node.attribute("name").value();
      if (name == joint || name == link)
        document.fail(node,
                      fmt::format("\"{}\" is there already, and the calibration has that axis of "
                                  "the positioner. Remove it from this file",
                                  shown(name)));
    }
  }
}

}  // namespace

std::string calibrated_flange(const UrdfChain& chain) {
  return chain.ends_at_joint ? chain.tip_link + "_calibrated" : "";
}

UrdfChain read_urdf(std::string_view text, const std::string& name, const UrdfEnds& ends) {
  Document document;
  document.name = name;
  read(document, text);
  return chain_of(document, ends).chain;
}

std::string calibrated_urdf(std::string_view text, const std::string& name, const UrdfEnds& ends,
                            const RigidArm& nominal, const RigidArm& calibrated,
                            const std::string& comment) {
  Document document;
  document.name = name;
  read(document, text);
  const Chain found = chain_of(document, ends);
  JointFrames moved;
  try {
    moved = moved_frames(found.chain.frames, nominal, calibrated);
  } catch (const FileError& error) {
    document.fail(error.what());
  }
  for (std::size_t i = 0; i < found.moving.size(); ++i) {
    put_origin(found.moving[i]->node, found.fixed_before[i].inverse() * moved.joints[i].origin);
    if (!moved.joints[i].axis.isApprox(found.moving[i]->axis, 1e-12))
      put_axis(found.moving[i]->node, moved.joints[i].axis);
  }
  // The correction of the last link applies to everything fixed to it.
  const Isometry3d off = moved.flange * found.chain.frames.flange.inverse();
  const std::string last = found.moving.back()->child;
  for (const UrdfJoint& joint : document.joints)
    if (joint.parent == last) put_origin(joint.node, off * joint.origin);
  if (const std::string link = calibrated_flange(found.chain); !link.empty()) {
    for (const pugi::xml_node& node : document.robot.children())
      if (node.attribute("name").value() == link)
        document.fail(
            node, fmt::format(
                      "\"{}\" is there already, as of a calibrated file. Give the file that it was "
                      "made of",
                      shown(link)));
    append_link(document.robot, link);
    append_joint(document.robot, "joint_" + link, "fixed", last, link, off);
  }
  refuse_second(document, moved);
  append_positioner(document.robot, moved, found.chain.base_link);
  document.robot.prepend_child(pugi::node_comment)
      .set_value((" " + commentable(comment) + " ").c_str());
  std::ostringstream out;
  document.xml.save(out, "", pugi::format_raw | pugi::format_no_declaration, pugi::encoding_utf8);
  return out.str();
}

std::string urdf_of(const JointFrames& frames, const std::string& robot_name,
                    const std::string& comment) {
  pugi::xml_document document;
  document.append_child(pugi::node_comment).set_value((" " + commentable(comment) + " ").c_str());
  pugi::xml_node robot = document.append_child("robot");
  robot.append_attribute("name").set_value(robot_name.c_str());
  std::string last = "base_link";
  append_link(robot, last);
  for (std::size_t i = 0; i < frames.joints.size(); ++i) {
    const std::string name = fmt::format("link_{}", i + 1);
    append_moving(robot, frames.joints[i], last, name);
    last = name;
  }
  append_link(robot, "flange");
  append_joint(robot, "joint_flange", "fixed", last, "flange", frames.flange);
  append_link(robot, "tcp");
  append_joint(robot, "joint_tcp", "fixed", "flange", "tcp", frames.tcp);
  append_positioner(robot, frames, "base_link");
  std::ostringstream out;
  document.save(out, "  ", pugi::format_default, pugi::encoding_utf8);
  return out.str();
}

}  // namespace cellcal::calib
