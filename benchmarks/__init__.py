"""How long the scores take, next to other programs and to what the machine can do."""
