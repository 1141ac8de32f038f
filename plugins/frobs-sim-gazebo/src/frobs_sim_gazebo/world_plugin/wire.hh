// Encoding of numbers and names in a message: packed, little-endian, a string as its length (u32) and bytes.
#pragma once

#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

namespace frobs
{
/// The operations; `frobs_sim_gazebo/protocol.py` has the same numbers.
enum class Op : uint8_t
{
  HELLO = 0,
  SETUP = 1,
  SPAWN = 2,
  REMOVE = 3,
  LAYOUT = 4,
  PART = 5,
  STEP = 6,
  GAINS = 7,
  WRITE = 8,
  PLACE = 9,
  RAYS = 10,
  PUSH = 11,
  GRAVITY = 12,
  MASS = 13,
  FRICTION = 14,
  STATE = 15,
  CLEAR = 16,
  MODELS = 17,
};

/// Decodes a message; missing data is an error.
class Reader
{
  public: explicit Reader(std::string _data) : data(std::move(_data)) {}

  public: template <typename T> T Get()
  {
    T value;
    std::memcpy(&value, this->Take(sizeof(T)), sizeof(T));
    return value;
  }

  public: uint32_t Count() { return this->Get<uint32_t>(); }

  public: std::string Text()
  {
    const uint32_t size = this->Count();
    const char *begin = this->Take(size);
    return std::string(begin, size);
  }

  public: std::vector<double> Numbers(size_t _count)
  {
    std::vector<double> values(_count);
    if (_count > 0)
      std::memcpy(values.data(), this->Take(_count * sizeof(double)), _count * sizeof(double));
    return values;
  }

  public: std::vector<uint32_t> Indices()
  {
    std::vector<uint32_t> values(this->Count());
    for (auto &value : values)
      value = this->Count();
    return values;
  }

  private: const char *Take(size_t _size)
  {
    if (_size > this->data.size() - this->at)
      throw std::runtime_error("a message is too short");
    const char *begin = this->data.data() + this->at;
    this->at += _size;
    return begin;
  }

  private: std::string data;
  private: size_t at = 0;
};

/// Encodes a message.
class Writer
{
  public: template <typename T> void Put(const T &_value)
  {
    this->data.append(reinterpret_cast<const char *>(&_value), sizeof(T));
  }

  public: void Put(const double *_values, size_t _count)
  {
    this->data.append(reinterpret_cast<const char *>(_values), _count * sizeof(double));
  }

  public: void Text(const std::string &_text)
  {
    this->Put(static_cast<uint32_t>(_text.size()));
    this->data += _text;
  }

  public: std::string data;
};
}
