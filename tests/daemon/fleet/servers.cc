#include "tests/daemon/fleet/servers.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <grp.h>
#include <pwd.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <pqxx/pqxx>
#include <thread>

#include "daemon/fleet/store.h"

namespace cellcal::daemon::fleet::testing {

namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

const passwd* unprivileged() { return ::getuid() == 0 ? ::getpwnam("nobody") : nullptr; }

std::string make_folder(const char* name) {
  std::string path =
      (fs::temp_directory_path() / (std::string("cellcal-") + name + "-XXXXXX")).string();
  if (::mkdtemp(path.data()) == nullptr) throw std::runtime_error("no folder: " + path);
  if (const passwd* user = unprivileged();
      user != nullptr && ::chown(path.c_str(), user->pw_uid, user->pw_gid) != 0)
    throw std::runtime_error("chown: " + path);
  return path;
}

void become_unprivileged() {
  const passwd* user = unprivileged();
  if (user == nullptr) return;
  if (::setgroups(0, nullptr) != 0 || ::setgid(user->pw_gid) != 0 || ::setuid(user->pw_uid) != 0)
    ::_exit(126);
}

[[noreturn]] void become(const std::vector<std::string>& command, const std::string& log) {
  become_unprivileged();
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  const int file = ::open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0644);
  ::dup2(file, STDOUT_FILENO);
  ::dup2(file, STDERR_FILENO);
  std::vector<char*> arguments;
  for (const std::string& one : command) arguments.push_back(const_cast<char*>(one.c_str()));
  arguments.push_back(nullptr);
  ::execv(arguments[0], arguments.data());
  ::_exit(127);
}

std::string postgres_program(const std::string& name) {
  for (const auto& version : fs::directory_iterator("/usr/lib/postgresql"))
    if (const fs::path program = version.path() / "bin" / name; fs::exists(program)) return program;
  throw std::runtime_error("postgresql is missing: apt install postgresql");
}

std::uint16_t free_port() {
  const int made = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  if (::bind(made, reinterpret_cast<sockaddr*>(&address), size) != 0 ||
      ::getsockname(made, reinterpret_cast<sockaddr*>(&address), &size) != 0)
    throw std::runtime_error("no free port");
  ::close(made);
  return ntohs(address.sin_port);
}

bool listens(std::uint16_t port) {
  const int made = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const bool yes = ::connect(made, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0;
  ::close(made);
  return yes;
}

std::vector<pid_t> children_of(pid_t pid) {
  const std::string own = std::to_string(pid);
  std::ifstream in("/proc/" + own + "/task/" + own + "/children");
  std::vector<pid_t> all;
  for (pid_t child = 0; in >> child;) all.push_back(child);
  return all;
}

/// False also for a zombie.
bool is_alive(pid_t pid) {
  std::ifstream in("/proc/" + std::to_string(pid) + "/stat");
  std::string stat;
  std::getline(in, stat);
  const std::size_t name_ends = stat.rfind(')');
  return name_ends != std::string::npos && stat.substr(name_ends + 2, 1) != "Z";
}

/// Queue limits of the shipped broker configuration.
std::string shipped_limits() {
  std::ifstream in(CELLCAL_MOSQUITTO_CONF);
  std::string limits;
  for (std::string line; std::getline(in, line);)
    if (line.starts_with("max_queued") || line.starts_with("max_inflight") ||
        line.starts_with("autosave"))
      limits += line + "\n";
  return limits;
}

}  // namespace

Server::Server(const std::vector<std::string>& command, const std::string& log) : pid_(::fork()) {
  if (pid_ == 0) become(command, log);
}

Server::~Server() { end(SIGKILL); }

void Server::end(int signal) {
  if (pid_ <= 0) return;
  ::kill(pid_, signal);
  int status = 0;
  ::waitpid(pid_, &status, 0);
  pid_ = -1;
}

Database& Database::shared() {
  static Database database;
  return database;
}

Database::Database(Disk disk, std::string address)
    : folder_(make_folder("postgres")), disk_(disk), address_(std::move(address)) {
  Server setup({postgres_program("initdb"), "-D", folder_ + "/data", "-U", "cellcal",
                "--auth=trust", "--no-sync", "--encoding=UTF8", "--locale=C"},
               folder_ + "/log");
  setup.end(0);
  if (!address_.empty())
    std::ofstream(folder_ + "/data/pg_hba.conf", std::ios::app)
        << "host all all " << address_ << "/24 trust\n";
  start();
}

Database::~Database() {
  server_->end(SIGQUIT);
  fs::remove_all(folder_);
}

void Database::start() {
  // A reported commit must be in the log; only a power failure would show that the log is on disk.
  const std::string sync = disk_ == Disk::kWaitedFor ? "on" : "off";
  std::vector<std::string> command{postgres_program("postgres"), "-D", folder_ + "/data", "-k",
                                   folder_};
  for (const std::string& setting :
       {"listen_addresses=" + address_, "fsync=" + sync, "full_page_writes=" + sync,
        std::string("shared_buffers=16MB"), std::string("max_connections=40"),
        std::string("track_commit_timestamp=on")})
    command.insert(command.end(), {"-c", setting});
  server_ = std::make_unique<Server>(command, folder_ + "/log");
  const bool up = within_reach([this] {
    try {
      return ask("host=" + folder_ + " user=cellcal dbname=postgres", "SELECT 1") == "1";
    } catch (const pqxx::failure&) {
      return false;
    }
  });
  if (!up) throw std::runtime_error("postgres did not start: " + folder_ + "/log");
}

void Database::crash() { server_->end(SIGQUIT); }

void Database::kill() {
  const std::vector<pid_t> children = children_of(server_->pid());
  server_->end(SIGKILL);
  for (const pid_t child : children) ::kill(child, SIGKILL);
  // Not children of this process; a restart with one of them running is refused.
  for (const pid_t child : children)
    while (is_alive(child)) std::this_thread::sleep_for(5ms);
}

std::string Database::uri() const {
  return "postgresql://cellcal@" + address_ + "/test" + std::to_string(created_);
}

std::string Database::create() {
  const std::string name = "test" + std::to_string(++created_);
  pqxx::connection connection("host=" + folder_ + " user=cellcal dbname=postgres");
  pqxx::nontransaction work(connection);
  work.exec("CREATE DATABASE " + name);
  return "host=" + folder_ + " user=cellcal dbname=" + name;
}

std::string Database::emptied() {
  if (emptied_.empty()) {
    emptied_ = create();
    const Store store({emptied_});
  }
  std::string sql =
      "SET search_path = fleet; DELETE FROM settings; INSERT INTO settings DEFAULT VALUES";
  // Tables referenced by others come last.
  for (const char* table :
       {"certificate_files", "certificates", "corrections", "calibrations", "session_facts",
        "checks", "activations", "alarms", "answers", "drops", "phases", "touches", "health",
        "presence", "journals", "cells", "quarantine", "quarantine_counts"})
    sql += std::string("; DELETE FROM ") + table;
  ask(emptied_, sql);
  return emptied_;
}

MqttBroker::MqttBroker(const std::string& more)
    : folder_(make_folder("mosquitto")), port_(free_port()) {
  std::ofstream(folder_ + "/conf")
      << "listener " << port_ << " 127.0.0.1\nallow_anonymous true\n"
      << more << "persistence true\npersistence_location " << folder_ << "/\n"
      << shipped_limits() << "max_packet_size 16777216\n";
  start();
}

MqttBroker::~MqttBroker() {
  server_.reset();
  fs::remove_all(folder_);
}

void MqttBroker::start() {
  server_ = std::make_unique<Server>(
      std::vector<std::string>{"/usr/sbin/mosquitto", "-c", folder_ + "/conf"}, folder_ + "/log");
  if (!within_reach([this] { return listens(port_); }))
    throw std::runtime_error("mosquitto did not start");
}

void MqttBroker::stop() { server_->end(SIGTERM); }

void MqttBroker::kill() { server_->end(SIGKILL); }

std::string ask(const std::string& connection, const std::string& sql) {
  pqxx::connection made(connection);
  pqxx::work work(made);
  const pqxx::result result = work.exec(sql);
  work.commit();
  std::string text;
  for (const auto& row : result) {
    if (!text.empty()) text += '\n';
    for (const auto& field : row) {
      if (field.num() > 0) text += '|';
      text += field.is_null() ? "" : field.c_str();
    }
  }
  return text;
}

bool within_reach(const std::function<bool()>& condition) {
  const auto end = std::chrono::steady_clock::now() + 30s;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(20ms);
  }
  return true;
}

}  // namespace cellcal::daemon::fleet::testing
