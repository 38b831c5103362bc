#pragma once
#pragma GCC system_header
// Definitions used by copies with faults. Every fault has a number; the environment variable
// CELLCAL_FAULT selects the active one (0: none), and CELLCAL_FAULTS_REACHED names a file with one byte
// for each: 1 reached, 2 not applicable (no such operator between these types).

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <type_traits>

namespace faults {

struct Board {
  int chosen = 0;
  volatile unsigned char* reached = nullptr;
  int size = 0;
};

inline Board open_board() {
  Board board;
  if (const char* text = std::getenv("CELLCAL_FAULT")) board.chosen = std::atoi(text);
  const char* path = std::getenv("CELLCAL_FAULTS_REACHED");
  const int file = path ? ::open(path, O_RDWR | O_CLOEXEC) : -1;
  if (file < 0) return board;
  struct stat facts {};
  if (::fstat(file, &facts) == 0 && facts.st_size > 0) {
    void* at = ::mmap(nullptr, facts.st_size, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
    if (at != MAP_FAILED) {
      board.reached = static_cast<volatile unsigned char*>(at);
      board.size = static_cast<int>(facts.st_size);
    }
  }
  ::close(file);
  return board;
}

inline const Board& board() {
  static const Board the_board = open_board();
  return the_board;
}

inline bool note(int fault, unsigned char what) {
  const Board& b = board();
  if (fault < b.size && b.reached[fault] != what) b.reached[fault] = what;
  return b.chosen == fault;
}

constexpr bool on(int fault) { return std::is_constant_evaluated() ? false : note(fault, 1); }
constexpr void impossible(int fault) {
  if (!std::is_constant_evaluated()) note(fault, 2);
}

// A binary operator `a < b` becomes `a < less(7, 8) < b`: precedence and order of evaluation are
// unchanged, for any operands. The first fault moves the limit itself to the other side (`<` to
// `<=`), the second negates the result.
template <class Op, class A>
struct Left {
  const A& a;
  Op op;
};

#define FAULTS_RELATION(NAME, SIGN, SHIFTED)                                    \
  struct NAME {                                                                 \
    int shift, turn;                                                            \
    constexpr NAME(int s, int t) : shift(s), turn(t) {}                         \
  };                                                                            \
  template <class A>                                                            \
  constexpr Left<NAME, A> operator SIGN(const A& a, NAME op) {                  \
    return {a, op};                                                             \
  }                                                                             \
  template <class A, class B>                                                   \
  constexpr bool operator SIGN(Left<NAME, A> l, const B& b) {                   \
    if constexpr (std::is_floating_point_v<A> || std::is_floating_point_v<B>) { \
      impossible(l.op.shift);                                                   \
    } else if (on(l.op.shift)) {                                                \
      return l.a SHIFTED b;                                                     \
    }                                                                           \
    return (l.a SIGN b) != on(l.op.turn);                                       \
  }
FAULTS_RELATION(less, <, <=)
FAULTS_RELATION(at_most, <=, <)
FAULTS_RELATION(more, >, >=)
FAULTS_RELATION(at_least, >=, >)
#undef FAULTS_RELATION

#define FAULTS_EQUALITY(NAME, SIGN)                            \
  struct NAME {                                                \
    int turn;                                                  \
    constexpr explicit NAME(int t) : turn(t) {}                \
  };                                                           \
  template <class A>                                           \
  constexpr Left<NAME, A> operator SIGN(const A& a, NAME op) { \
    return {a, op};                                            \
  }                                                            \
  template <class A, class B>                                  \
  constexpr bool operator SIGN(Left<NAME, A> l, const B& b) {  \
    return (l.a SIGN b) != on(l.op.turn);                      \
  }
FAULTS_EQUALITY(equal, ==)
FAULTS_EQUALITY(unequal, !=)
#undef FAULTS_EQUALITY

#define FAULTS_SUM(NAME, SIGN, OTHER)                                              \
  struct NAME {                                                                    \
    int turn;                                                                      \
    constexpr explicit NAME(int t) : turn(t) {}                                    \
  };                                                                               \
  template <class A>                                                               \
  constexpr Left<NAME, A> operator SIGN(const A& a, NAME op) {                     \
    return {a, op};                                                                \
  }                                                                                \
  template <class A, class B>                                                      \
  constexpr auto operator SIGN(Left<NAME, A> l, const B& b) {                      \
    if constexpr (requires { l.a OTHER b; }) {                                     \
      if constexpr (std::is_same_v<decltype(l.a OTHER b), decltype(l.a SIGN b)>) { \
        return on(l.op.turn) ? l.a OTHER b : l.a SIGN b;                           \
      } else {                                                                     \
        impossible(l.op.turn);                                                     \
        return l.a SIGN b;                                                         \
      }                                                                            \
    } else {                                                                       \
      impossible(l.op.turn);                                                       \
      return l.a SIGN b;                                                           \
    }                                                                              \
  }
FAULTS_SUM(plus, +, -)
FAULTS_SUM(minus, -, +)
#undef FAULTS_SUM

/// Adds one to an integer; doubles a floating-point number, and replaces 0.0 by 1.0.
template <class T>
constexpr T wrong_number(T value) {
  if constexpr (std::is_floating_point_v<T>)
    return value == T(0) ? T(1) : T(2) * value;
  else
    return static_cast<T>(value + 1);
}
template <class T>
constexpr T number(int fault, T value) {
  return on(fault) ? wrong_number(value) : value;
}
/// The next two, for initialisers of constants, are never evaluated at compile time.
inline bool met(int fault) { return note(fault, 1); }
template <class T>
T constant(int fault, T value) {
  return note(fault, 1) ? wrong_number(value) : value;
}
template <class T>
constexpr auto unsign(int fault, const T& value) {
  return on(fault) ? static_cast<decltype(-value)>(value) : -value;
}

}  // namespace faults
