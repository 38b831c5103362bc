#pragma once
// Debian's mosquitto and postgresql, for the tests alone: own data folders, a Unix socket, a free port of the
// loopback. As root they are run as nobody. They end with the tests, whatever ends these.

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
  /// Sends it and waits for the end.
  void end(int signal);

 private:
  pid_t pid_;
};

/// Whether commits wait for the disk: where the time is what is measured.
enum class Disk { kNotWaitedFor, kWaitedFor };

/// Keeps when each transaction was committed.
class Database {
 public:
  /// `address`: of this computer, where it listens besides; its network may come in. Empty: on a Unix socket alone.
  explicit Database(Disk disk = Disk::kNotWaitedFor, std::string address = "");
  ~Database();
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;
  /// One for the whole program.
  static Database& shared();

  /// Of a new, empty database, as libpq takes it.
  std::string create();
  /// Of one with the newest tables and no rows. The same each time: to make one takes a quarter of a second.
  std::string emptied();
  /// The newest of them, from elsewhere.
  std::string uri() const;
  /// As a crash leaves it, and again.
  void crash();
  /// kill -9 of the server and of all that it has running.
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
  /// Orderly, what it holds is on disk; then again on the same port.
  void stop();
  /// kill -9.
  void kill();
  void start();

 private:
  std::string folder_;
  std::uint16_t port_;
  std::unique_ptr<Server> server_;
};

/// All rows, "a|b" each, joined by line feeds. Throws what libpqxx throws.
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
