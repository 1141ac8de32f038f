#!/bin/sh
echo this node fails >&2
exit 3
