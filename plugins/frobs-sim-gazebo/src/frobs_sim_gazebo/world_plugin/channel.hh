// The connection to the process that started the server: a socket that it opened and this process inherited.
#pragma once

#include <string>

#include "wire.hh"

namespace frobs
{
/// Frames of u32 size, u8 operation or verdict, body. The inherited socket needs no listening port.
class Channel
{
  /// Take over the socket, and end this process as soon as the other end is closed, even during a computation.
  public: explicit Channel(int _socket);

  /// Wait for a request.
  public: Op Receive(std::string &_body);

  public: void Answer(const std::string &_body) { this->Send(1, _body); }

  public: void Refuse(const std::string &_why) { this->Send(0, _why); }

  private: void Send(uint8_t _verdict, const std::string &_body);

  private: void Read(char *_into, size_t _size);

  private: int socket;
};
}
