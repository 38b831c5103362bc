#pragma once
// Debian's mosquitto and postgresql, for tests only: own data folders, a Unix socket, a free port of the
// loopback. Started by root, they run as nobody. They end with the tests in any case.

#include <sys/types.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace cellcal::daemon::fleet::testing {

/// A program that is killed with its owner, and with the thread that started it.
class Server {
 public:
  Server(const std::vector<std::string>& command, const std::string& log);
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  pid_t pid() const { return pid_; }
  /// Sends the signal and waits for the end.
  void end(int signal);

 private:
  pid_t pid_;
};

/// Wait of commits for the disk, for measurements of time.
enum class Disk { kNotWaitedFor, kWaitedFor };

/// Records the commit time of each transaction.
class Database {
 public:
  /// `address`: additional listening address; its network is admitted. Empty: on a Unix socket only.
  explicit Database(Disk disk = Disk::kNotWaitedFor, std::string address = "");
  ~Database();
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;
  /// A single instance for the whole program.
  static Database& shared();

  /// libpq connection string of a new, empty database.
  std::string create();
  /// Likewise with the current tables and no rows; always the same, as creating one takes 0.25 s.
  std::string emptied();
  /// URI of the newest one, for other hosts.
  std::string uri() const;
  /// Leaves it as after a crash.
  void crash();
  /// SIGKILL for the server and all its processes.
  void kill();
  void start();

 private:
  std::string folder_;
  Disk disk_;
  std::string address_;
  std::unique_ptr<Server> server_;
  int created_ = 0;
  std::string emptied_;
};

class MqttBroker {
 public:
  /// `more`: lines of mosquitto.conf.
  explicit MqttBroker(const std::string& more = "");
  ~MqttBroker();
  MqttBroker(const MqttBroker&) = delete;
  MqttBroker& operator=(const MqttBroker&) = delete;
  std::uint16_t port() const { return port_; }
  /// Orderly, with its data saved; start() uses the same port.
  void stop();
  /// SIGKILL.
  void kill();
  void start();

 private:
  std::string folder_;
  std::uint16_t port_;
  std::unique_ptr<Server> server_;
};

/// All rows, "a|b" each, joined by line feeds. Throws exceptions of libpqxx.
std::string ask(const std::string& connection, const std::string& sql);

/// False: it did not become true within half a minute.
bool within_reach(const std::function<bool()>& condition);

struct Publication {
  std::string topic, payload;
  bool retain = false;
};
/// In order, quality of service 1; returns when the broker has acknowledged all. Throws std::runtime_error.
void publish(std::uint16_t port, const std::vector<Publication>& all);

}  // namespace cellcal::daemon::fleet::testing
