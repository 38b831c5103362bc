#include "broker.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <signal.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <stdexcept>
#include <thread>

namespace cellcal::daemon::testing {

namespace {

sockaddr_in loopback(std::uint16_t port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = ::htonl(INADDR_LOOPBACK);
  address.sin_port = ::htons(port);
  return address;
}

std::uint16_t free_port() {
  const int probe = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address = loopback(0);
  socklen_t size = sizeof address;
  ::bind(probe, reinterpret_cast<sockaddr*>(&address), size);
  ::getsockname(probe, reinterpret_cast<sockaddr*>(&address), &size);
  ::close(probe);
  return ::ntohs(address.sin_port);
}

bool listens(std::uint16_t port) {
  const int probe = ::socket(AF_INET, SOCK_STREAM, 0);
  const sockaddr_in address = loopback(port);
  const bool there =
      ::connect(probe, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  ::close(probe);
  return there;
}

pid_t spawn(const std::vector<std::string>& words, const std::string& output) {
  std::vector<char*> arguments;
  for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t files;
  ::posix_spawn_file_actions_init(&files);
  ::posix_spawn_file_actions_addopen(&files, 1, output.c_str(), O_WRONLY | O_CREAT | O_APPEND,
                                     0600);
  ::posix_spawn_file_actions_adddup2(&files, 1, 2);
  pid_t process = 0;
  const int failed =
      ::posix_spawnp(&process, arguments[0], &files, nullptr, arguments.data(), environ);
  ::posix_spawn_file_actions_destroy(&files);
  if (failed != 0) throw std::runtime_error("cannot start " + words[0]);
  return process;
}

}  // namespace

void run_tool(const std::vector<std::string>& words) {
  int status = 0;
  ::waitpid(spawn(words, "/dev/null"), &status, 0);
  if (status != 0) throw std::runtime_error(words[0] + " failed");
}

Broker::Broker(const std::filesystem::path& dir, const std::string& more)
    : dir_(dir), port_(free_port()) {
  std::ofstream(dir_ / "mosquitto.conf")
      << "user root\nlistener " << port_ << " 127.0.0.1\n"
      << "persistence true\npersistence_location " << dir_.string() << "/\n"
      << "autosave_on_changes true\nautosave_interval 1\n"
      << more;
  start();
}

Broker::~Broker() { end(SIGTERM); }

void Broker::start() {
  process_ = spawn({"/usr/sbin/mosquitto", "-c", dir_ / "mosquitto.conf"}, dir_ / "mosquitto.log");
  for (int i = 0; i < 2000; ++i) {
    if (listens(port_)) return;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  throw std::runtime_error("mosquitto does not listen");
}

void Broker::kill() { end(SIGKILL); }

void Broker::end(int signal) {
  if (process_ == 0) return;
  ::kill(process_, signal);
  ::waitpid(process_, nullptr, 0);
  process_ = 0;
}

}  // namespace cellcal::daemon::testing
