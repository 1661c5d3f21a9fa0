"""What moves in a pass and what it leaves: masses on springs, a beam, a wheelset, wheel modes, indentation."""
