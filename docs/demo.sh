#!/bin/sh
# The steps of `make demo` after the installation: train, evaluate, draw the curve, make a video, print a summary.
# Reads FROBS (the command), ID, SEED and CONTROLLER (may be empty) from the environment.
set -eu

name=$(basename "$ID" | tr '[:upper:]' '[:lower:]')${CONTROLLER:+-$CONTROLLER}-seed$SEED
run=demo/$name
number=2
while [ -e "$run" ]; do # an earlier demo stays as it is
  run=demo/$name-$number
  number=$((number + 1))
done

echo "1/4  Training on $ID; all files go to $run."
"$FROBS" train "$ID" --seed "$SEED" --run-dir "$run" ${CONTROLLER:+--controller "$CONTROLLER"}
echo "2/4  Evaluating on 1,000 new goals."
"$FROBS" evaluate "$run" --episodes 1000
echo "3/4  Drawing the learning curve."
"$FROBS" plot "$run"
echo "4/4  Making a video."
"$FROBS" play "$run" --video "$run/video.mp4" --episodes 2 || echo "No video was made; everything else is complete."
echo
"$FROBS" show "$run"
cat <<END

Look at:  $run/plots/learning_curve.png
$([ ! -f "$run/video.mp4" ] || echo "          $run/video.mp4")
Next:     $FROBS play $run            # watch the arm in a window
          $FROBS list envs             # other environments, many with a trained policy
          make install                 # everything else that FRobs has; then, for example:
          $FROBS view frobs/PandaPickAndPlace-v0        # a trained policy in the browser
          $FROBS train frobs/PandaPickAndPlace-v0 --algorithm dagger   # learn it in a minute
Read:     docs/tutorials/index.md
END
