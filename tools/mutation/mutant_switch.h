// What planted mutants are switched by (mutant_sites.h): all of them are compiled into one program,
// which is the original until the variable VISCERA_MUTANT of its environment names one. So a
// thousand mutants cost one build [Untch1993].
#pragma once

#include <algorithm>
#include <array>
#include <cstdlib>
#include <fstream>
#include <initializer_list>
#include <type_traits>

namespace viscera_mutant {

inline constexpr int kMost = 4096;

inline int chosen_by(const char* name) {
  const char* text = std::getenv(name);
  return text ? std::atoi(text) : -1;
}

inline const int chosen = chosen_by("VISCERA_MUTANT");

/// Which mutants a test comes by: their numbers are added to the file VISCERA_MUTANTS_REACHED when
/// the program ends.
struct Reached {
  const char* file = std::getenv("VISCERA_MUTANTS_REACHED");
  std::array<unsigned char, kMost> by{};
  Reached() = default;
  Reached(const Reached&) = delete;
  Reached& operator=(const Reached&) = delete;
  ~Reached() {
    if (!file) return;
    std::ofstream out(file, std::ios::app);
    for (std::size_t k = 0; k < by.size(); ++k)
      if (by[k]) out << k << '\n';
  }
};
inline Reached reached;

inline bool on(int number) {
  if (reached.file) reached.by[static_cast<std::size_t>(number)] = 1;
  return chosen == number;
}

/// Before the right-hand side of a sum: turns its sign.
struct Sign {
  bool turned;
};
inline Sign sign(int number) {
  return {on(number)};
}
template <class T>
auto operator*(Sign sign, const T& value) {
  if constexpr (std::is_arithmetic_v<T>)
    return sign.turned ? static_cast<T>(-value) : value;
  else
    return (sign.turned ? typename T::Scalar(-1) : typename T::Scalar(1)) * value;
}

/// Within a product or before a quotient's divisor: doubles it.
struct Factor {
  bool doubled;
};
inline Factor factor(int number) {
  return {on(number)};
}
template <class T>
auto operator*(const T& value, Factor factor) {
  if constexpr (std::is_arithmetic_v<T>)
    return factor.doubled ? static_cast<T>(value + value) : value;
  else
    return (factor.doubled ? typename T::Scalar(2) : typename T::Scalar(1)) * value;
}

/// A number of the source: twice itself; one for zero; a tolerance, which hardly anybody notices
/// doubled, 10,000 times itself.
template <class T>
T number(int number, T value) {
  if (!on(number)) return value;
  if (value == T(0)) return T(1);
  return value < T(1e-4) ? value * T(1e4) : value * T(2);
}

/// `a <less(7)> b` is a < b; as a mutant a <= b of whole numbers, a > b of others.
enum class Relation { kLess, kLessEqual, kGreater, kGreaterEqual, kEqual, kUnequal };
template <Relation relation>
struct Comparison {
  bool turned;
};
template <Relation relation>
Comparison<relation> compare(int number) {
  return {on(number)};
}
template <class A, Relation relation>
struct Compared {
  const A& left;
  bool turned;
};
template <class A, Relation relation>
Compared<A, relation> operator<(const A& left, Comparison<relation> comparison) {
  return {left, comparison.turned};
}
template <Relation relation, class A, class B>
bool holds(const A& a, const B& b) {
  if constexpr (relation == Relation::kLess) return a < b;
  if constexpr (relation == Relation::kLessEqual) return a <= b;
  if constexpr (relation == Relation::kGreater) return a > b;
  if constexpr (relation == Relation::kGreaterEqual) return a >= b;
  if constexpr (relation == Relation::kEqual) return a == b;
  if constexpr (relation == Relation::kUnequal) return a != b;
}
template <class A, Relation relation, class B>
bool operator>(Compared<A, relation> compared, const B& b) {
  using enum Relation;
  const A& a = compared.left;
  if (!compared.turned) return holds<relation>(a, b);
  if constexpr (relation == kEqual || relation == kUnequal) {
    return !holds<relation>(a, b);
  } else if constexpr (std::is_integral_v<A> && std::is_integral_v<B>) {
    // The border changes sides.
    constexpr Relation other = relation == kLess        ? kLessEqual
                               : relation == kLessEqual ? kLess
                               : relation == kGreater   ? kGreaterEqual
                                                        : kGreater;
    return holds<other>(a, b);
  } else {
    constexpr Relation other = relation == kLess        ? kGreater
                               : relation == kLessEqual ? kGreaterEqual
                               : relation == kGreater   ? kLess
                                                        : kLessEqual;
    return holds<other>(a, b);
  }
}

/// std::max and std::min, each for the other as a mutant.
struct Extreme {
  bool greatest;
  template <class T>
  T operator()(const T& a, const T& b) const {
    return greatest ? std::max(a, b) : std::min(a, b);
  }
  template <class T>
  T operator()(std::initializer_list<T> values) const {
    return greatest ? std::max(values) : std::min(values);
  }
};
inline Extreme greatest(int number) {
  return {!on(number)};
}
inline Extreme least(int number) {
  return {on(number)};
}

}  // namespace viscera_mutant
