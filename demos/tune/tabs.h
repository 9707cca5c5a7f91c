#pragma once
/// The browser tabs of a session. Each has one stream and a mailbox with the latest message of each kind: a
/// slow tab misses replaced messages, and never blocks others or uses more memory.

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

namespace offstage::tune {

inline constexpr std::size_t kMostTabs = 8;

class Tabs {
 public:
  struct Message {
    std::string kind;  ///< "frame", "cell:3"; a later message of the same kind replaces it
    std::string json;
  };

  /// Opens the stream of a tab and returns its ticket; an earlier stream of the same tab ends. Returns
  /// nothing if there are already kMostTabs others. The first tab is the writer.
  std::optional<uint64_t> open(const std::string& tab);
  /// Ends a stream, unless the tab has a newer one. The tab that has been open longest becomes the writer.
  void close(const std::string& tab, uint64_t ticket);
  void close_all();

  /// Puts a message into every mailbox.
  void post(const std::string& kind, const std::string& json);
  /// The next message of a stream. `over`: the stream has ended.
  struct Next {
    std::optional<Message> message;
    bool over = false;
  };
  Next wait(const std::string& tab, uint64_t ticket, std::chrono::milliseconds limit);

  /// The tab that may change the scene; empty if none is open.
  std::string writer() const;
  /// Makes an open tab the writer.
  bool take_over(const std::string& tab);
  std::size_t count() const;
  bool has_room() const { return count() < kMostTabs; }

 private:
  struct Tab {
    uint64_t ticket = 0, since = 0;
    std::deque<Message> mailbox;
  };
  void choose_writer();
  void put(Tab& tab, const std::string& kind, const std::string& json);

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::map<std::string, Tab> tabs_;
  std::string writer_;
  uint64_t tickets_ = 0;
  bool closed_ = false;
};

}  // namespace offstage::tune
