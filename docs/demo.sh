#!/bin/sh
# What `make demo` does once FRobs is installed: train, evaluate, draw the curve, make a video, sum up.
# Takes FROBS (the command), ID, SEED and CONTROLLER (may be empty) from the environment.
set -eu

name=$(basename "$ID" | tr '[:upper:]' '[:lower:]')${CONTROLLER:+-$CONTROLLER}-seed$SEED
run=demo/$name
number=2
while [ -e "$run" ]; do # an earlier demo stays as it is
  run=demo/$name-$number
  number=$((number + 1))
done

echo "1/4  Training on $ID; everything goes to $run."
"$FROBS" train "$ID" --seed "$SEED" --run-dir "$run" ${CONTROLLER:+--controller "$CONTROLLER"}
echo "2/4  Evaluating on 1,000 goals that training never saw."
"$FROBS" evaluate "$run" --episodes 1000
echo "3/4  Drawing the learning curve."
"$FROBS" plot "$run"
echo "4/4  Making a video."
"$FROBS" play "$run" --video "$run/video.mp4" || echo "The video was left out; everything else is there."
echo
"$FROBS" show "$run"
